#include "study/one_run.h"

#include "study/figures.h"
#include "study/points.h"
#include "study/run_folder.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

typedef struct Run {
    OpenStudy *open;
    int64_t number;
    Scene *scene;
    SharedVessel *vessel;
    HeadlessOptions options;
    HeadlessRun headless;
    ToolPath *golden, *path;
    cJSON *figures;
    RunStatus status;
    char message[FAULT_LENGTH], hash[20];
    Faults faults;
} Run;

// --- before ---

static void use_hands(Run *run)
{
    ToolNames tools = scene_tool_names(run->scene);
    char *text = study_hands(&run->open->study->hands, study_hand_seed(run->open->study, run->number), &tools);
    Script *script = text ? script_parse(text, strlen(text), "hands", &tools, &run->faults) : NULL;
    free(text);
    script_free(run->scene->script);
    run->scene->script = script;
}

static void load_golden(Run *run)
{
    char *path = golden_path_of(run->scene->path);
    run->golden = golden_load(path, &run->faults);
    free(path);
}

static bool prepare(Run *run)
{
    const Study *study = run->open->study;
    const char *path = study_scene(study, run->number);
    char *text = study_scene_text(study, run->number, open_study_scene_text(run->open, path), &run->faults);
    run->scene = text ? scene_parse(text, strlen(text), path, &run->faults) : NULL;
    free(text);
    if (run->scene && study->hands.wanted)
        use_hands(run);
    if (run->scene && study->keeps_golden)
        load_golden(run);
    run->options.duration_s = study->duration_s;
    run->options.settle_s = study->settle_s;
    run->options.scores = study->keeps_score;
    if (run->golden && run->options.duration_s < 0)
        run->options.duration_s = run->golden->duration_s;
    return run->scene && run->faults.count == 0 && (run->vessel = open_study_vessel(run->open, run->scene, &run->faults)) &&
           open_vessel_inlet(run->scene, shared_vessel(run->vessel), &run->faults);
}

// --- during ---

static void sample(void *context, const HeadlessRun *headless)
{
    Run *run = context;
    if (run->path)
        tool_path_sample(run->path, headless->simulator, false);
}

// False with faults.
static bool simulate(Run *run)
{
    if (!headless_open(&run->headless, &run->options, run->scene, shared_vessel(run->vessel), &run->faults))
        return false;
    if (run->golden)
        run->path = tool_path_create(run->headless.simulator, run->options.duration_s);
    run->headless.watch = sample;
    run->headless.context = run;
    if (run->options.record)
        pthread_mutex_lock(&run->open->files);
    bool good = headless_drive(&run->headless, NULL, NULL, &run->faults);
    if (run->options.record)
        pthread_mutex_unlock(&run->open->files);
    return good;
}

// --- after ---

static void add_score(Run *run)
{
    ScoreFigures figures = score_figures(session_tracker_score(run->headless.tracker));
    cJSON *score = cJSON_CreateObject();
    score_add_json(score, &figures);
    figures_add(run->figures, score, "score.");
    cJSON_Delete(score);
}

static void add_golden(Run *run)
{
    tool_path_sample(run->path, run->headless.simulator, true);
    PathDifference difference = tool_path_compare(run->golden, run->path, COMPARE_TOLERANCE_MM);
    cJSON_AddNumberToObject(run->figures, "golden.worst_mm", difference.worst_mm);
    cJSON_AddNumberToObject(run->figures, "golden.differs", difference.differs);
    if (difference.differs)
        cJSON_AddNumberToObject(run->figures, "golden.first_t_s", difference.first_t_s);
}

static bool is_kept(const Study *study, const char *name)
{
    for (int i = 0; i < study->figure_count; i++)
        if (path_is_part_of(name, study->figure[i]))
            return true;
    return study->figure_count == 0;
}

static void drop_unwanted(Run *run)
{
    for (cJSON *item = run->figures->child, *next; item; item = next) {
        next = item->next;
        if (!is_kept(run->open->study, item->string))
            cJSON_Delete(cJSON_DetachItemViaPointer(run->figures, item));
    }
}

static void judge(Run *run)
{
    Simulator *simulator = run->headless.simulator;
    const RunTotals *totals = simulator_totals(simulator);
    char *text = run_summary_json(simulator, &run->headless.report, run->headless.node);
    cJSON *summary = cJSON_Parse(text);
    snprintf(run->hash, sizeof run->hash, "%.16s", cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(summary, "state_hash")));
    figures_add(run->figures, summary, "");
    cJSON_Delete(summary);
    free(text);
    if (run->headless.tracker)
        add_score(run);
    if (run->path)
        add_golden(run);
    drop_unwanted(run);
    if (run->headless.report.end == DRIVE_DIVERGED) {
        run->status = RUN_DIVERGED;
        snprintf(run->message, sizeof run->message, "diverged at %.3f s", simulator_time_s(simulator));
    } else if (run_left_vessel(totals)) {
        run->status = RUN_LEFT;
        snprintf(run->message, sizeof run->message, "the tool left the vessel, %.3f mm outside the wall", totals->penetration_max);
    }
}

static char *result_line(const Run *run, double cpu_s)
{
    cJSON *line = cJSON_CreateObject();
    cJSON_AddNumberToObject(line, "run", (double)run->number);
    cJSON_AddStringToObject(line, "status", run_status_name[run->status]);
    cJSON_AddStringToObject(line, "message", run->message);
    cJSON_AddStringToObject(line, "state_hash", run->hash);
    cJSON_AddNumberToObject(line, "cpu_s", cpu_s);
    cJSON_AddItemToObject(line, "figures", cJSON_Duplicate(run->figures, true));
    char *text = cJSON_PrintUnformatted(line);
    cJSON_Delete(line);
    return text;
}

static void close_run(Run *run)
{
    tool_path_free(run->path);
    tool_path_free(run->golden);
    headless_close(&run->headless);
    vessel_cache_release(run->vessel, IDLE_VESSELS_MOST);
    scene_free(run->scene);
    cJSON_Delete(run->figures);
    free(run);
}

static Run *begin_run(OpenStudy *open, int64_t number)
{
    Run *run = HEAP_ZEROED(1, sizeof *run);
    run->open = open;
    run->number = number;
    run->figures = cJSON_CreateObject();
    return run;
}

static void run_once(Run *run)
{
    if (prepare(run) && simulate(run)) {
        judge(run);
    } else {
        run->status = RUN_FAILED;
        snprintf(run->message, sizeof run->message, "%s", run->faults.text[0]);
    }
}

static char *run_recorded(OpenStudy *open, int64_t number, const char *record, const volatile sig_atomic_t *stop, RunStatus *status, Faults *faults)
{
    double begin = clock_s(CLOCK_THREAD_CPUTIME_ID);
    Run *run = begin_run(open, number);
    run->options.stop = stop;
    run->options.record = record;
    run_once(run);
    *status = run->status;
    // a recording that cannot be written is the fault of the folder, not of the run
    bool is_lost = record && run->headless.simulator && run->faults.count > 0, is_stopped = stop && *stop;
    if (is_lost) {
        const char *why = run->faults.text[0];       // FILE: reason
        size_t length = strlen(record);
        faults_add(faults, record, 0, 0, "%.400s; the same command goes on", strncmp(why, record, length) ? why : why + length + strspn(why + length, ": "));
    }
    char *line = is_lost || is_stopped ? NULL : result_line(run, clock_s(CLOCK_THREAD_CPUTIME_ID) - begin);
    close_run(run);
    return line;
}

char *one_run(OpenStudy *open, int64_t number, const char *recordings, const volatile sig_atomic_t *stop, Faults *faults)
{
    RecordKind kind = recordings ? open->study->record : RECORD_NONE;
    char record[PATH_MAX];
    RunStatus status;
    snprintf(record, sizeof record, "%.4000s/%lld.h5", recordings ? recordings : "", (long long)number);
    char *line = run_recorded(open, number, kind == RECORD_ALL ? record : NULL, stop, &status, faults);
    if (!line || kind != RECORD_FAILURES || status == RUN_DONE || status == RUN_FAILED)
        return line;
    // the same steps again: failures are rare, and only then is a recording wanted
    free(line);
    return run_recorded(open, number, record, stop, &status, faults);
}

char *one_run_repeat(OpenStudy *open, int64_t number, const char *folder, Faults *faults)
{
    char record[PATH_MAX], summary[PATH_MAX];
    Run *run = begin_run(open, number);
    snprintf(record, sizeof record, "%.4000s/recording.h5", folder);
    snprintf(summary, sizeof summary, "%.4000s/summary.json", folder);
    run->options.record = record;
    run_once(run);
    if (run->scene)
        run_folder_write(folder, run->scene, open->study, number, faults);
    if (run->status == RUN_FAILED || run->faults.count > 0)
        faults_add(faults, folder, 0, 0, "run %lld: %.400s", (long long)number, run->faults.text[0]);
    else
        run_write_summary(summary, run->headless.simulator, &run->headless.report, run->headless.node, faults);
    char *line = faults->count == 0 ? result_line(run, 0) : NULL;
    close_run(run);
    return line;
}
