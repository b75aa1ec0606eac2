// Recordings: the values read back are those simulated; a kill at any time leaves a file that can be opened and is complete up to its last flush; so do a full
// disk and a full index. `test_recording N` kills N recordings at random times; useful under load.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sim/drive.h"
#include "sim/ordered_file.h"
#include "sim/pose.h"
#include "sim/replay.h"

#include <glob.h>
#include <hdf5.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static Faults faults;
static char folder[] = "/tmp/seldinger-recording-XXXXXX";
#include "tests/folder.h"
#include "tests/short_run.h"

static const char scene_text[] = "seldinger: 1\n"
                                 "wire: {elements: 20, sections: [{length_mm: 40, diameter_mm: 0.36, young_modulus_gpa: 80}]}\n"
                                 "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 20}\n"
                                 "rig: {gravity_m_s2: [0, 0, -9.81]}\n"
                                 "script: [[0, 10, 90], [0.2, -5, 0], [0.4, 0, 0]]\n";

// The maximum number of tools, each longer than the one around it; the hands move tips out and in again.
static const char tools_text[] =
    "seldinger: 1\n"
    "tools:\n"
    "  - {name: guide, kind: guide_catheter, elements: 10, inserted_mm: 10, sections: [{length_mm: 30, diameter_mm: 2, inner_diameter_mm: 1.8, "
    "young_modulus_gpa: 1}]}\n"
    "  - {name: catheter, kind: catheter, elements: 12, inserted_mm: 12, sections: [{length_mm: 40, diameter_mm: 1.6, inner_diameter_mm: 1.2, "
    "young_modulus_gpa: 1}]}\n"
    "  - {name: micro, kind: microcatheter, elements: 14, inserted_mm: 11, sections: [{length_mm: 50, diameter_mm: 1, inner_diameter_mm: 0.6, "
    "young_modulus_gpa: 1}]}\n"
    "  - {name: wire, kind: wire, elements: 16, inserted_mm: 14, sections: [{length_mm: 60, diameter_mm: 0.36, young_modulus_gpa: 20}]}\n"
    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\n";
// The same, each with a device that can replace it.
static const char devices_text[] =
    "seldinger: 1\n"
    "tools:\n"
    "  - {name: guide, kind: guide_catheter, elements: 10, inserted_mm: 10, sections: [{length_mm: 30, diameter_mm: 2, inner_diameter_mm: 1.8, "
    "young_modulus_gpa: 1}],\n"
    "     exchange: [{elements: 20, sections: [{length_mm: 30, diameter_mm: 2, inner_diameter_mm: 1.8, young_modulus_gpa: 1}]}]}\n"
    "  - {name: catheter, kind: catheter, elements: 12, inserted_mm: 12, sections: [{length_mm: 40, diameter_mm: 1.6, inner_diameter_mm: 1.2, "
    "young_modulus_gpa: 1}],\n"
    "     exchange: [{elements: 9, sections: [{length_mm: 40, diameter_mm: 1.6, inner_diameter_mm: 1.2, young_modulus_gpa: 1}]}]}\n"
    "  - {name: micro, kind: microcatheter, elements: 14, inserted_mm: 11, sections: [{length_mm: 50, diameter_mm: 1, inner_diameter_mm: 0.6, "
    "young_modulus_gpa: 1}],\n"
    "     exchange: [{elements: 17, sections: [{length_mm: 50, diameter_mm: 1, inner_diameter_mm: 0.6, young_modulus_gpa: 1}]}]}\n"
    "  - {name: wire, kind: wire, elements: 16, inserted_mm: 14, sections: [{length_mm: 60, diameter_mm: 0.36, young_modulus_gpa: 20}],\n"
    "     exchange: [{elements: 11, sections: [{length_mm: 60, diameter_mm: 0.36, young_modulus_gpa: 200}]}]}\n"
    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\n";
static const char *text_of_scene = scene_text;
enum { TOOLS = 4 };

// Each tool moves back and forth at its own rhythm by 2 to 4 mm; sometimes no hand holds the wire.
static ToolCommands hands_at(int64_t step)
{
    ToolCommands commands = {.released = step % 500 > 400 ? 8 : 0};
    for (int k = 0; k < TOOLS; k++) {
        int64_t half = 100 + 30 * k;
        commands.tool[k] = (Command){step / half % 2 ? -20 : 20, 40 * k};
    }
    return commands;
}

static Simulator *make_simulator(Scene **scene)
{
    faults_clear(&faults);
    *scene = scene_parse(text_of_scene, strlen(text_of_scene), "r.yaml", &faults);
    Simulator *simulator = *scene ? simulator_create(*scene, NULL, &faults) : NULL;
    if (!simulator)
        fail_msg("%s", faults.text[0]);
    return simulator;
}

enum { MOST_STEPS = 500 };
typedef struct Seen {
    Recording *recording;
    int steps;
    uint64_t hash[MOST_STEPS];
    Vec3 tip[MOST_STEPS];
    double inserted[MOST_STEPS];
    Command command[MOST_STEPS];
} Seen;

static bool see(void *context, Simulator *simulator, const ToolCommands *commands)
{
    Seen *seen = context;
    const WireState *state = simulator_state(simulator);
    seen->hash[seen->steps] = simulator_hash(simulator);
    seen->tip[seen->steps] = state->position[state->node_count - 1];
    seen->inserted[seen->steps] = state->inserted;
    seen->command[seen->steps++] = commands->tool[0];
    return !seen->recording || recording_step(seen->recording, simulator, commands, NULL);
}

static Seen run_once(const char *record)
{
    Scene *scene;
    Simulator *simulator = make_simulator(&scene);
    RecordingOptions options = recording_default_options();
    options.expected_steps = 100;   // less than the run has: further chunks are made
    Seen seen = {.recording = record ? recording_create(record, simulator, &options, &faults) : NULL};
    if (record && !seen.recording)
        fail_msg("%s", faults.text[0]);
    DriveOptions drive = drive_default_options();
    drive.script = scene->script;
    drive.duration_s = 0.405;
    drive.after_step = see;
    drive.context = &seen;
    assert_int_equal(simulator_drive(simulator, &drive).end, DRIVE_DONE);
    if (record)
        assert_true(recording_close(seen.recording, simulator, &faults));
    simulator_destroy(simulator);
    scene_free(scene);
    return seen;
}

static void what_is_read_is_what_was_simulated(void **state)
{
    (void)state;
    char path[256];
    snprintf(path, sizeof path, "%s/a.h5", folder);
    static Seen recorded, plain;
    recorded = run_once(path);
    plain = run_once(NULL);
    assert_int_equal(recorded.steps, 405);
    // the same run with and without a recording is bit-identical
    assert_memory_equal(recorded.hash, plain.hash, sizeof *plain.hash * 405);

    RecordedRun *run = recorded_run_load(path, &faults);
    if (!run)
        fail_msg("%s", faults.text[0]);
    assert_int_equal(run->step_count, 405);
    assert_int_equal(run->node_count, 21);
    assert_string_equal(run->scene_text, scene_text);
    // the first step, every tenth, and the last
    assert_int_equal(run->frame_count, 1 + 40 + 1);
    for (int i = 0; i < 405; i++) {
        assert_true(fabs(run->time_s[i] - 0.001 * (i + 1)) < 1e-12);
        assert_true(run->state_hash[i] == plain.hash[i]);
        assert_true(run->command[2 * i] == plain.command[i].push_mm_s && run->command[2 * i + 1] == plain.command[i].twist_deg_s);
    }
    for (int64_t k = 0; k < run->frame_count; k++) {
        int64_t step = run->frame_step[k];
        assert_int_equal(step, k == 0 ? 0 : k == 41 ? 404 : 10 * k - 1);
        assert_true(vec3_distance(run->position[k * 21 + 20], plain.tip[step]) == 0);
    }
    recorded_run_free(run);
}

// All rows of a dataset as read by any HDF5 reader; NULL if they cannot be read.
static double *read_rows(hid_t file, const char *name, hsize_t *rows, hsize_t *values)
{
    hid_t set = H5Dopen2(file, name, H5P_DEFAULT), space = set >= 0 ? H5Dget_space(set) : -1;
    hsize_t extent[3] = {0, 1, 1};
    double *data = NULL;
    if (space >= 0 && H5Sget_simple_extent_dims(space, extent, NULL) >= 1) {
        *rows = extent[0];
        *values = extent[0] * extent[1] * extent[2];
        data = calloc(*values + 1, sizeof *data);
        if (data && H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0) {
            free(data);
            data = NULL;
        }
    }
    H5Sclose(space);
    H5Dclose(set);
    return data;
}

// --- several tools ---

static bool copy_file(const char *from, const char *to)
{
    static char buffer[1 << 20];
    FILE *source = fopen(from, "rb"), *target = fopen(to, "wb");
    bool good = source && target;
    for (size_t size; good && (size = fread(buffer, 1, sizeof buffer, source)) > 0;)
        good = fwrite(buffer, 1, size, target) == size;
    if (source)
        fclose(source);
    return (!target || fclose(target) == 0) && good;
}

static void assert_same_pose(const Pose *a, const Pose *b)
{
    assert_true(a->step == b->step && a->inserted_mm == b->inserted_mm && a->node_count == b->node_count && a->first_free_node == b->first_free_node);
    assert_memory_equal(a->position, b->position, (size_t)a->node_count * sizeof *a->position);
    assert_memory_equal(a->quaternion, b->quaternion, (size_t)a->node_count * sizeof *a->quaternion);
    for (int i = 0; i < a->node_count; i++)
        assert_true(a->node[i].s == b->node[i].s && a->node[i].radius == b->node[i].radius);
    for (int k = 0; k < a->tool_count; k++) {
        const PoseTool *one = &a->tool[k], *other = &b->tool[k];
        assert_true(one->push_n == other->push_n && one->torque_n_mm == other->torque_n_mm && one->inserted_mm == other->inserted_mm);
        assert_true(one->command.push_mm_s == other->command.push_mm_s && one->command.twist_deg_s == other->command.twist_deg_s);
        assert_int_equal(one->node_count, other->node_count);
        for (int j = 0; j < one->node_count; j++) {
            assert_memory_equal(&one->node[j].position, &other->node[j].position, sizeof(Vec3));
            assert_memory_equal(&one->node[j].orientation, &other->node[j].orientation, sizeof(Quat));
            assert_true(one->node[j].s == other->node[j].s && one->node[j].radius == other->node[j].radius && one->node[j].carrier == other->node[j].carrier);
        }
    }
}

static void assert_replays(const RecordedRun *run)
{
    Scene *scene = replay_scene(run, "tools.h5", &faults);
    Simulator *simulator = scene ? simulator_create(scene, NULL, &faults) : NULL;
    assert_non_null(simulator);
    assert_true(replay_fits(run, simulator, &faults));
    ReplayVerdict verdict = replay_verify(simulator, run, -1, false, NULL, NULL);
    assert_int_equal(verdict.first_different, -1);
    assert_int_equal(verdict.steps, run->step_count);
    simulator_destroy(simulator);
    // also by the script made from it
    size_t length;
    char *text = replay_script(run, &length);
    ToolNames names = scene_tool_names(scene);
    Script *script = script_parse(text, length, "hand.csv", &names, &faults);
    if (!script)
        fail_msg("%s", faults.text[0]);
    int cursor = 0;
    for (int64_t i = 0; i < run->step_count; i++) {
        ToolCommands read = script_tools_at(script, (double)i * run->step_ms / 1000, &cursor), was = recorded_run_commands(run, i);
        assert_memory_equal(read.tool, was.tool, sizeof was.tool);
        assert_int_equal(read.released, was.released);
        assert_memory_equal(read.fitted, was.fitted, sizeof was.fitted);
    }
    // the devices that are in at the end stay in
    ToolCommands after = script_tools_at(script, 1e6, &cursor), last = recorded_run_commands(run, run->step_count - 1);
    assert_memory_equal(after.fitted, last.fitted, sizeof last.fitted);
    script_free(script);
    free(text);
    scene_free(scene);
}

static void what_is_read_of_several_tools(void **state)
{
    (void)state;
    enum { STEPS = 605 };
    char path[256];
    snprintf(path, sizeof path, "%s/tools.h5", folder);
    text_of_scene = tools_text;
    Scene *scene;
    Simulator *simulator = make_simulator(&scene);
    RecordingOptions options = recording_default_options();
    Recording *recording = recording_create(path, simulator, &options, &faults);
    assert_non_null(recording);
    static Pose *seen[STEPS + 1];
    static uint64_t hash[STEPS];
    int least = 1000, most = 0;
    for (int i = 0; i < STEPS; i++) {
        ToolCommands commands = hands_at(i);
        simulator_step(simulator, &commands);
        assert_true(recording_step(recording, simulator, &commands, NULL));
        hash[i] = simulator_hash(simulator);
        seen[i] = pose_create_for(simulator);
        pose_take(seen[i], simulator, &commands, &(XrayControl){0});
        least = seen[i]->node_count < least ? seen[i]->node_count : least;
        most = seen[i]->node_count > most ? seen[i]->node_count : most;
    }
    assert_true(recording_close(recording, simulator, &faults));
    RecordedRun *run = recorded_run_load(path, &faults);
    if (!run)
        fail_msg("%s", faults.text[0]);
    print_message("%d to %d nodes of at most %d\n", least, most, run->node_count);
    assert_true(least < most);   // nodes are added and removed
    assert_int_equal(run->step_count, STEPS);
    assert_int_equal(run->tool_count, TOOLS);
    assert_int_equal(run->frame_count, 1 + 60 + 1);
    assert_string_equal(run->tool[2].name, "micro");
    assert_string_equal(run->tool[2].kind, "microcatheter");
    assert_memory_equal(run->state_hash, hash, sizeof hash);
    for (int i = 0; i < STEPS; i++) {
        ToolCommands read = recorded_run_commands(run, i), given = hands_at(i);
        assert_memory_equal(read.tool, given.tool, sizeof given.tool);
        assert_int_equal(read.released, given.released);
    }
    Pose *pose = pose_create_for_run(run);
    for (int64_t k = 0; k < run->frame_count; k++) {
        pose_from_run(pose, scene, run, k);
        assert_same_pose(pose, seen[run->frame_step[k]]);
    }
    // there are no values beyond the nodes in use
    assert_true(run->frame_nodes[0] < run->node_count);
    for (int64_t k = 0; k < run->frame_count; k++)
        for (int64_t i = 0; i < run->node_count; i++) {
            int64_t at = k * run->node_count + i;
            bool is_unused = i >= run->frame_nodes[k];
            assert_true(isnan(run->position[at].x) == is_unused && isnan(run->quaternion[at].w) == is_unused && isnan(run->s[at]) == is_unused);
            for (int c = 0; c < 3; c++)
                assert_true(isnan(run->force[3 * at + c]) == is_unused);
            assert_true(isnan(run->gap[at]) == is_unused && isnan(run->radius[at]) == is_unused);
            assert_true(!is_unused || run->vessel_node[at] == -1);
        }
    assert_replays(run);
    pose_free(pose);
    for (int i = 0; i < STEPS; i++)
        pose_free(seen[i]);
    recorded_run_free(run);
    RecordedRun *series = recorded_run_load_series(path, &faults);
    assert_true(series && series->tool_count == TOOLS && series->frame_count == 0 && series->tool[3].inserted[STEPS - 1] > 0);
    recorded_run_free(series);
    simulator_destroy(simulator);
    scene_free(scene);
    text_of_scene = scene_text;
}

// --- sessions: stored values are rounded, poses are stored as differences ---

static void what_is_read_of_a_session(void **state)
{
    (void)state;
    static const char *const texts[] = {scene_text, tools_text};
    for (int t = 0; t < 2; t++) {
        enum { STEPS = 2345 };
        char path[256];
        snprintf(path, sizeof path, "%s/session.h5", folder);
        text_of_scene = texts[t];
        Scene *scene;
        Simulator *simulator = make_simulator(&scene);
        RecordingOptions options = recording_session_options();
        Recording *recording = recording_create(path, simulator, &options, &faults);
        assert_non_null(recording);
        static Pose *seen[STEPS + 1];
        static uint64_t hash[STEPS];
        static double push[STEPS];
        for (int i = 0; i < STEPS; i++) {
            ToolCommands commands = hands_at(i);
            commands.tool[1] = t ? commands.tool[1] : (Command){0};
            simulator_step(simulator, &commands);
            assert_true(recording_step(recording, simulator, &commands, NULL));
            hash[i] = simulator_hash(simulator);
            push[i] = simulator_last(simulator)->push[0];
            if (i == 0 || i % 10 == 9 || i == STEPS - 1) {
                seen[i] = pose_create_for(simulator);
                pose_take(seen[i], simulator, &commands, &(XrayControl){0});
            }
        }
        assert_true(recording_close(recording, simulator, &faults));
        RecordedRun *run = recorded_run_load(path, &faults);
        if (!run)
            fail_msg("%s", faults.text[0]);
        assert_int_equal(run->step_count, STEPS);
        assert_int_equal(run->frame_count, 1 + 234 + 1);
        assert_memory_equal(run->state_hash, hash, sizeof hash);
        for (int i = 0; i < STEPS; i++)
            assert_true(fabs(run->proximal[2 * i] - push[i]) <= 0.5 / 16384);
        Pose *pose = pose_create_for_run(run);
        for (int64_t k = 0; k < run->frame_count; k++) {
            const Pose *was = seen[run->frame_step[k]];
            pose_from_run(pose, scene, run, k);
            assert_int_equal(pose->node_count, was->node_count);
            for (int i = 0; i < was->node_count; i++) {
                assert_true(fabs(pose->position[i].x - was->position[i].x) <= 0.5 / 128 && fabs(pose->position[i].z - was->position[i].z) <= 0.5 / 128);
                assert_true(fabs(pose->quaternion[i].w - was->quaternion[i].w) <= 0.5 / 512 && fabs(pose->quaternion[i].z - was->quaternion[i].z) <= 0.5 / 512);
                assert_int_equal(pose->node[i].vessel_node, was->node[i].vessel_node);
                assert_true(fabs(pose->node[i].force.y - was->node[i].force.y) <= 0.6 / 2048);
                assert_true(isinf(was->node[i].gap) ? isinf(pose->node[i].gap) : fabs(pose->node[i].gap - was->node[i].gap) <= 0.6 / 128);
            }
            for (int n = 0; t && n < TOOLS; n++)
                for (int j = 0; j < was->tool[n].node_count; j++) {
                    assert_true(vec3_distance(pose->tool[n].node[j].position, was->tool[n].node[j].position) <= 1.0 / 128);
                    assert_int_equal(pose->tool[n].node[j].carrier, was->tool[n].node[j].carrier);
                }
        }
        assert_replays(run);
        // any reader finds one frame per second
        hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
        hsize_t rows = 0, values = 0;
        double *step = read_rows(file, "/wire/step", &rows, &values);
        assert_int_equal(rows, 1 + 2);
        assert_true(step[0] == 0 && step[1] == 999 && step[2] == 1999);
        free(step);
        H5Fclose(file);
        pose_free(pose);
        for (int i = 0; i < STEPS; i++) {
            pose_free(seen[i]);
            seen[i] = NULL;
        }
        recorded_run_free(run);
        simulator_destroy(simulator);
        scene_free(scene);
    }
    text_of_scene = scene_text;
}

// --- tools that are exchanged ---

static const char exchange_text[] =
    "seldinger: 1\n"
    "tools:\n"
    "  - {name: micro, kind: microcatheter, elements: 10, inserted_mm: 8, sections: [{length_mm: 20, diameter_mm: 0.8, inner_diameter_mm: 0.5, "
    "young_modulus_gpa: 1}],\n"
    "     exchange: [{elements: 16, sections: [{length_mm: 25, diameter_mm: 0.9, inner_diameter_mm: 0.6, young_modulus_gpa: 1}]}]}\n"
    "  - {name: wire, kind: wire, elements: 16, inserted_mm: 10, sections: [{length_mm: 60, diameter_mm: 0.36, young_modulus_gpa: 20}],\n"
    "     exchange: [{elements: 12, sections: [{length_mm: 55, diameter_mm: 0.3, young_modulus_gpa: 100}]},\n"
    "                {elements: 21, sections: [{length_mm: 70, diameter_mm: 0.4, young_modulus_gpa: 200}]}]}\n"
    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0]}\n";

// An exchange of the wire is requested too early; the wire is pulled back, exchanged twice and pushed in again; then the microcatheter is pulled back and
// exchanged over it.
static ToolCommands exchange_at(int step)
{
    ToolCommands commands = {.fitted = {step >= 1000, step < 40 ? 0 : step < 60 ? 1 : step < 300 ? 0 : step < 310 ? 1 : 2}};
    commands.tool[1].push_mm_s = step < 60 ? 0 : step < 300 ? -100 : step < 320 ? 0 : step < 620 ? 100 : 0;
    commands.tool[0].push_mm_s = step < 700 ? 0 : step < 1000 ? -40 : 20;
    return commands;
}

// Poses of other lengths and numbers of nodes, replayed bit for bit.
static void what_is_read_of_exchanged_tools(void **state)
{
    (void)state;
    enum { STEPS = 1205 };
    char path[256];
    snprintf(path, sizeof path, "%s/exchange.h5", folder);
    text_of_scene = exchange_text;
    Scene *scene;
    Simulator *simulator = make_simulator(&scene);
    RecordingOptions options = recording_default_options();
    Recording *recording = recording_create(path, simulator, &options, &faults);
    assert_non_null(recording);
    static Pose *seen[STEPS];
    for (int i = 0; i < STEPS; i++) {
        ToolCommands commands = exchange_at(i);
        simulator_step(simulator, &commands);
        assert_true(recording_step(recording, simulator, &commands, NULL));
        seen[i] = pose_create_for(simulator);
        pose_take(seen[i], simulator, &commands, &(XrayControl){0});
    }
    assert_true(recording_close(recording, simulator, &faults));
    assert_int_equal(simulator_totals(simulator)->exchanges, 3);
    assert_int_equal(simulator_totals(simulator)->refused_exchanges, 1);
    assert_true(seen[50]->refused_exchanges == 1 && seen[50]->refusal == EXCHANGE_INSERTED && seen[50]->tool[1].fitted == 0);
    RecordedRun *run = recorded_run_load(path, &faults);
    if (!run)
        fail_msg("%s", faults.text[0]);
    assert_int_equal(run->step_count, STEPS);
    static const struct {
        int step, tool, asked, fitted, nodes;
    } in[] = {{0, 1, 0, 0, 17}, {50, 1, 1, 0, 17}, {305, 1, 1, 1, 13}, {900, 1, 2, 2, 22}, {900, 0, 0, 0, 11}, {1204, 0, 1, 1, 17}};
    for (size_t i = 0; i < sizeof in / sizeof *in; i++) {
        assert_int_equal(recorded_run_commands(run, in[i].step).fitted[in[i].tool], in[i].asked);
        assert_int_equal(recorded_run_fitted(run, in[i].tool, in[i].step), in[i].fitted);
        assert_int_equal(seen[in[i].step]->tool[in[i].tool].node_count, in[i].nodes);
    }
    Pose *pose = pose_create_for_run(run);
    for (int64_t k = 0; k < run->frame_count; k++) {
        pose_from_run(pose, scene, run, k);
        assert_same_pose(pose, seen[run->frame_step[k]]);
        for (int tool = 0; tool < 2; tool++)
            assert_true(pose->tool[tool].fitted == seen[run->frame_step[k]]->tool[tool].fitted &&
                        pose->tool[tool].node_capacity == seen[0]->tool[tool].node_capacity);
    }
    assert_replays(run);
    pose_free(pose);
    for (int i = 0; i < STEPS; i++)
        pose_free(seen[i]);
    recorded_run_free(run);
    simulator_destroy(simulator);
    scene_free(scene);
    text_of_scene = scene_text;
}

// A copy with one changed piece is refused with this message.
static void expect_refused(const char *path, void (*change)(hid_t file), const char *words)
{
    char broken[256];
    snprintf(broken, sizeof broken, "%s/broken.h5", folder);
    assert_true(copy_file(path, broken));
    hid_t file = H5Fopen(broken, H5F_ACC_RDWR, H5P_DEFAULT);
    assert_true(file >= 0);
    change(file);
    assert_true(H5Fclose(file) >= 0);
    faults_clear(&faults);
    RecordedRun *run = recorded_run_load(broken, &faults);
    if (run || !strstr(faults.text[0], words))
        fail_msg("expected '%s', got '%s'", words, run ? "a recording" : faults.text[0]);
}

static void replace(hid_t file, const char *name, hid_t type, int rank, const hsize_t *size, hid_t creation)
{
    hid_t space = H5Screate_simple(rank, size, NULL);
    H5Ldelete(file, name, H5P_DEFAULT);
    hid_t set = H5Dcreate2(file, name, type, space, H5P_DEFAULT, creation, H5P_DEFAULT);
    assert_true(set >= 0);
    H5Dclose(set);
    H5Sclose(space);
}

static void write_value(hid_t file, const char *name, hid_t type, const hsize_t *at, int rank, const void *value)
{
    hid_t set = H5Dopen2(file, name, H5P_DEFAULT), space = H5Dget_space(set), memory = H5Screate(H5S_SCALAR);
    const hsize_t one[3] = {1, 1, 1};
    assert_true(rank == H5Sget_simple_extent_ndims(space) && H5Sselect_hyperslab(space, H5S_SELECT_SET, at, NULL, one, NULL) >= 0);
    assert_true(H5Dwrite(set, type, memory, space, H5P_DEFAULT, value) >= 0);
    H5Sclose(memory);
    H5Sclose(space);
    H5Dclose(set);
}

static void time_is(hid_t file, int row, double time_s) { write_value(file, "/time_s", H5T_NATIVE_DOUBLE, (const hsize_t[]){(hsize_t)row}, 1, &time_s); }
static void time_is_nan(hid_t file) { time_is(file, 7, NAN); }
static void time_is_infinite(hid_t file) { time_is(file, 604, INFINITY); }
static void time_begins_nowhere(hid_t file) { time_is(file, 0, NAN); }
static void time_begins_late(hid_t file) { time_is(file, 0, 1e300); }
static void time_jumps(hid_t file) { time_is(file, 604, 1e300); }
static void time_goes_back(hid_t file) { time_is(file, 7, 0.004); }
static void time_stands(hid_t file) { time_is(file, 7, 0.007); }
static void push_is_nan(hid_t file) { write_value(file, "/command", H5T_NATIVE_DOUBLE, (const hsize_t[]){7, 0}, 2, &(double){NAN}); }
static void turns_without_end(hid_t file) { write_value(file, "/xray", H5T_NATIVE_DOUBLE, (const hsize_t[]){7, 2}, 2, &(double){1e30}); }
static void node_is_nowhere(hid_t file) { write_value(file, "/wire/position", H5T_NATIVE_DOUBLE, (const hsize_t[]){3, 1, 2}, 3, &(double){NAN}); }
static void own_node_is_nowhere(hid_t file) { write_value(file, "/tools/1/quaternion", H5T_NATIVE_DOUBLE, (const hsize_t[]){3, 1, 2}, 3, &(double){INFINITY}); }
static void lose_tool(hid_t file) { H5Ldelete(file, "/tools/1", H5P_DEFAULT); }
static void lose_name(hid_t file) { H5Adelete_by_name(file, "/tools/2", "name", H5P_DEFAULT); }
static void rename_tool(hid_t file)
{
    hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR), place = H5Gopen2(file, "/tools/2", H5P_DEFAULT);
    H5Tset_size(type, 8);
    H5Adelete(place, "name");
    hid_t attribute = H5Acreate2(place, "name", type, space, H5P_DEFAULT, H5P_DEFAULT);
    assert_true(H5Awrite(attribute, type, "a\nb,c\0\0") >= 0);
    H5Aclose(attribute);
    H5Gclose(place);
    H5Sclose(space);
    H5Tclose(type);
}
static void lose_hand(hid_t file) { H5Ldelete(file, "/tools/3/command", H5P_DEFAULT); }
static void widen_hand(hid_t file) { replace(file, "/tools/1/proximal", H5T_NATIVE_DOUBLE, 2, (const hsize_t[]){605, 3}, H5P_DEFAULT); }
static void other_nodes(hid_t file) { replace(file, "/tools/1/position", H5T_NATIVE_DOUBLE, 3, (const hsize_t[]){62, 99, 3}, H5P_DEFAULT); }
static void too_many_nodes(hid_t file) { write_value(file, "/wire/count", H5T_NATIVE_INT, (const hsize_t[]){5}, 1, &(int){1000}); }
static void no_node(hid_t file) { write_value(file, "/wire/count", H5T_NATIVE_INT, (const hsize_t[]){5}, 1, &(int){0}); }
static void no_such_device(hid_t file) { write_value(file, "/exchange", H5T_NATIVE_INT, (const hsize_t[]){7, 1, 0}, 3, &(int){9}); }
static void unknown_device(hid_t file) { write_value(file, "/exchange", H5T_NATIVE_INT, (const hsize_t[]){9, 0, 1}, 3, &(int){2}); }
static void no_profile(hid_t file) { write_value(file, "/tools/1/s_mm", H5T_NATIVE_DOUBLE, (const hsize_t[]){1, 1}, 2, &(double){NAN}); }
static void lose_exchange(hid_t file) { H5Ldelete(file, "/exchange", H5P_DEFAULT); }
static void steps_of(hid_t file, double step_ms)
{
    hid_t attribute = H5Aopen(file, "step_ms", H5P_DEFAULT);
    assert_true(H5Awrite(attribute, H5T_NATIVE_DOUBLE, &step_ms) >= 0);
    H5Aclose(attribute);
}
static void steps_of_nothing(hid_t file) { steps_of(file, 0); }
static void steps_too_long(hid_t file) { steps_of(file, 100.1); }
static void no_such_carrier(hid_t file) { write_value(file, "/tools/2/carrier", H5T_NATIVE_INT, (const hsize_t[]){3, 4}, 2, &(int){7}); }

// Huge and empty: a chunk that was never written uses no space in the file.
static void promise(hid_t file)
{
    hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(creation, 1, &(hsize_t){1 << 20});
    replace(file, "/time_s", H5T_NATIVE_DOUBLE, 1, &(hsize_t){1 << 28}, creation);
    H5Pclose(creation);
}

// By a filter that the program does not use.
static void pack(hid_t file)
{
    hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(creation, 1, &(hsize_t){605});
    H5Pset_fletcher32(creation);
    replace(file, "/time_s", H5T_NATIVE_DOUBLE, 1, &(hsize_t){605}, creation);
    H5Pclose(creation);
}

// A chunk with fewer bytes than its shape needs, as in a damaged index.
static void cut_chunk(hid_t file)
{
    static const double value[605];
    hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(creation, 1, &(hsize_t){605});
    replace(file, "/time_s", H5T_NATIVE_DOUBLE, 1, &(hsize_t){605}, creation);
    H5Pclose(creation);
    hid_t set = H5Dopen2(file, "/time_s", H5P_DEFAULT);
    assert_true(H5Dwrite_chunk(set, H5P_DEFAULT, 0, &(hsize_t){0}, 64, value) >= 0);
    H5Dclose(set);
}

static void read_elsewhere(hid_t file)
{
    hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_external(creation, "/etc/passwd", 0, 800);
    replace(file, "/time_s", H5T_NATIVE_DOUBLE, 1, &(hsize_t){100}, creation);
    H5Pclose(creation);
}

static void link_elsewhere(hid_t file)
{
    char path[256];
    snprintf(path, sizeof path, "%s/tools.h5", folder);
    H5Ldelete(file, "/time_s", H5P_DEFAULT);
    assert_true(H5Lcreate_external(path, "/inserted_mm", file, "/time_s", H5P_DEFAULT, H5P_DEFAULT) >= 0);
}

// Many chunks at the same bytes: all children of the index point to the first one, and the file ends behind it.
enum { SHARED_CHUNKS = 60, SHARED_ROWS = 1 << 18 };
static void make_shared_chunk(const char *path)
{
    hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT), creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(creation, 1, &(hsize_t){SHARED_ROWS});
    H5Pset_fill_time(creation, H5D_FILL_TIME_NEVER);
    replace(file, "/time_s", H5T_NATIVE_DOUBLE, 1, &(hsize_t){SHARED_CHUNKS * SHARED_ROWS}, creation);
    H5Pclose(creation);
    double *value = malloc(SHARED_ROWS * sizeof *value);
    for (int i = 0; i < SHARED_ROWS; i++)
        value[i] = 0.001 * (i + 1);
    hid_t set = H5Dopen2(file, "/time_s", H5P_DEFAULT);
    haddr_t address = HADDR_UNDEF, at;
    hsize_t size;
    for (int i = 0; i < SHARED_CHUNKS; i++) {
        const hsize_t row = (hsize_t)i * SHARED_ROWS;
        assert_true(H5Dwrite_chunk(set, H5P_DEFAULT, 0, &row, SHARED_ROWS * sizeof *value, value) >= 0);
        assert_true(H5Dget_chunk_info_by_coord(set, &row, NULL, &at, &size) >= 0);
        address = at < address ? at : address;
    }
    free(value);
    H5Dclose(set);
    assert_true(H5Fclose(file) >= 0);

    FILE *stream = fopen(path, "r+b");
    unsigned char *bytes = malloc(address + size);
    assert_int_equal(fread(bytes, 1, address + size, stream), address + size);
    size_t node = 0, step = 24 + 8;     // of an entry: a key (size, mask, two offsets) and a child
    for (size_t i = 0; i + 8 < address; i++)
        if (!memcmp(bytes + i, "TREE\1\0", 6) && bytes[i + 6] == SHARED_CHUNKS)
            node = i;
    assert_true(node > 0);
    for (size_t i = 0; i < SHARED_CHUNKS; i++)
        memcpy(bytes + node + 24 + 24 + i * step, &(uint64_t){address}, 8);
    memcpy(bytes + 44, &(uint64_t){address + size}, 8);     // the end of file in the superblock
    rewind(stream);
    assert_int_equal(fwrite(bytes, 1, address + size, stream), address + size);
    assert_int_equal(fclose(stream), 0);
    assert_int_equal(truncate(path, (off_t)(address + size)), 0);
    free(bytes);
}

static void one_chunk_is_not_read_many_times(void **state)
{
    (void)state;
    char path[256], shared[256];
    snprintf(path, sizeof path, "%s/tools.h5", folder);
    snprintf(shared, sizeof shared, "%s/shared.h5", folder);
    assert_true(copy_file(path, shared));
    make_shared_chunk(shared);
    faults_clear(&faults);
    RecordedRun *run = recorded_run_load(shared, &faults);
    if (run || !strstr(faults.text[0], "/time_s promises 15728640 values, but has more or larger chunks than the file"))
        fail_msg("expected a refusal, got '%s'", run ? "a recording" : faults.text[0]);
}

// Runs after what_is_read_of_several_tools() and uses its file.
static void what_is_broken_is_refused(void **state)
{
    (void)state;
    char path[256];
    snprintf(path, sizeof path, "%s/tools.h5", folder);
    expect_refused(path, time_is_nan, "/time_s holds nan in row 7; expected finite numbers");
    expect_refused(path, time_is_infinite, "/time_s holds inf in row 604");
    expect_refused(path, time_begins_nowhere, "/time_s holds nan in row 0");
    expect_refused(path, time_begins_late, "/time_s holds 1e+300 s in row 0");
    expect_refused(path, time_jumps, "/time_s holds 1e+300 s in row 604; expected rows 0.001 s apart, starting at 0.001 s");
    expect_refused(path, time_goes_back, "/time_s holds 0.004 s in row 7");
    expect_refused(path, time_stands, "/time_s holds 0.007 s in row 7");
    expect_refused(path, steps_of_nothing, "has steps of 0 ms; expected 0.001 to 100");
    expect_refused(path, steps_too_long, "has steps of 100.1 ms; expected 0.001 to 100");
    expect_refused(path, push_is_nan, "/command holds nan in row 7");
    expect_refused(path, turns_without_end, "/xray holds 1e+30 in row 7, column 2; expected -360 to 360");
    expect_refused(path, node_is_nowhere, "frame 3 has a node that is not a number");
    expect_refused(path, own_node_is_nowhere, "frame 3 has a node that is not a number");
    expect_refused(path, lose_tool, "/tools does not hold the groups 0 to 1");
    expect_refused(path, lose_name, "/tools/2 has no string attribute 'name'");
    expect_refused(path, rename_tool, "/tools/2 has no string attribute 'name'");
    expect_refused(path, lose_hand, "has no dataset /tools/3/command");
    expect_refused(path, widen_hand, "/tools/1/proximal has the wrong shape (605, 3); expected (any, 2)");
    expect_refused(path, other_nodes, "/tools/1/position has the wrong shape (62, 99, 3); expected (any, 13, 3)");
    expect_refused(path, too_many_nodes, "frame 5 has 1000 nodes; expected 2 to 56");
    expect_refused(path, no_node, "frame 5 has 0 nodes");
    expect_refused(path, no_such_carrier, "/tools/2/carrier names tool 7; expected -1 to 3");
    expect_refused(path, promise, "/time_s promises 268435456 values, but has more or larger chunks than the file");
    expect_refused(path, pack, "/time_s promises 605 values, but is compressed by filters other");
    expect_refused(path, cut_chunk, "/time_s promises 605 values, but has truncated chunks");
    expect_refused(path, read_elsewhere, "/time_s promises 100 values, but is stored in another file");
    expect_refused(path, link_elsewhere, "/time_s is a soft or external link; expected a dataset of this file");
    snprintf(path, sizeof path, "%s/exchange.h5", folder);
    expect_refused(path, no_such_device, "/exchange names device 9 in step 7; expected 0 to 4");
    expect_refused(path, unknown_device, "/exchange has device 2 of tool 0 in step 9; the file holds 2 of them");
    expect_refused(path, no_profile, "/tools/1/s_mm holds 1 nodes of device 1; expected at least 2");
    expect_refused(path, lose_exchange, "/tools/0/s_mm has the wrong shape");
}

// --- a child that records until it is ended ---

static void record_for_ever(const char *path, int64_t expected_steps)
{
    Scene *scene;
    Simulator *simulator = make_simulator(&scene);
    RecordingOptions options = recording_default_options();
    options.flush_s = 0.1;   // often: the chance to be caught in a flush
    options.expected_steps = expected_steps;
    Recording *recording = recording_create(path, simulator, &options, &faults);
    int cursor = 0;
    for (int64_t i = 0; recording; i++) {
        ToolCommands commands = scene->script ? script_tools_at(scene->script, (double)(i % 400) / 1000, &cursor) : hands_at(i);
        simulator_step(simulator, &commands);
        if (!recording_step(recording, simulator, &commands, NULL))
            break;
    }
    _exit(9);
}

static void nap_ms(long ms) { nanosleep(&(struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000}, NULL); }

static int64_t load_rows(const char *path)
{
    faults_clear(&faults);
    RecordedRun *run = recorded_run_load(path, &faults);
    if (!run)
        fail_msg("%s", faults.text[0]);
    int64_t steps = run->step_count;
    recorded_run_free(run);
    return steps;
}

static bool is_rounded;      // a session's: quaternions to 1/512 in each of four values
static bool unwritten(const char *name, const double *value, hsize_t values)
{
    for (hsize_t i = 0; strcmp(name, "/time_s") == 0 && i < values; i++)
        if (fabs(value[i] - 0.001 * (double)(i + 1)) > 1e-9 * (double)(i + 1))
            return true;
    for (hsize_t i = 0; strcmp(name, "/state_hash") == 0 && i < values; i++)
        if (value[i] == 0)
            return true;
    for (hsize_t i = 0; strcmp(name, "/wire/quaternion") == 0 && i < values; i += 4)
        if (fabs(value[i] * value[i] + value[i + 1] * value[i + 1] + value[i + 2] * value[i + 2] + value[i + 3] * value[i + 3] - 1) >
            (is_rounded ? 2.1 / 512 : 1e-9))
            return true;
    return false;
}

// One dataset's part of check_file().
static const char *check_rows(hid_t file, const char *name, hsize_t *count, bool first)
{
    hsize_t rows = 0, values = 0;
    double *data = read_rows(file, name, &rows, &values);
    if (first)
        *count = rows;
    bool differs = rows != *count && text_of_scene == scene_text;     // with several tools they are on several pages
    *count = rows < *count ? rows : *count;
    const char *fault = !data ? "cannot be read" : differs ? "rows differ" : unwritten(name, data, values) ? "unwritten rows" : NULL;
    free(data);
    return fault;
}

static herr_t check_motion(hid_t group, const char *name, const H5O_info_t *info, void *context)
{
    hsize_t *least = context, rows = 0, values = 0;
    double *data = info->type == H5O_TYPE_DATASET ? read_rows(group, name, &rows, &values) : NULL;
    if (data && rows < *least)
        *least = rows;
    free(data);
    return info->type == H5O_TYPE_DATASET && !data ? -1 : 0;
}

// Reads every dataset completely: all datasets of one kind have the same number of rows, and every row was written. Returns NULL or a description of the error.
static const char *check_file(const char *path, hsize_t count[2])
{
    static const char *const names[2][15] = {
        {"/time_s", "/command", "/proximal", "/state_hash", "/inserted_mm", "/released", "/report/penetration_mm", "/report/contacts", "/report/iterations",
         "/report/residual", "/report/linearisations", "/report/wall_force_n", "/report/flags", "/xray"},
        {"/wire/step", "/wire/position", "/wire/quaternion", "/contact/force_n", "/contact/gap_mm", "/contact/vessel_node"}};
    static const char *const tool_names[2][5] = {{"command", "proximal", "inserted_mm", "released"}, {"position", "quaternion", "carrier"}};
    static const char *const several_names[] = {"/wire/count", "/wire/s_mm", "/wire/radius_mm"};
    hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);   // locking on
    if (file < 0)
        return "cannot be opened";
    const char *fault = NULL;
    int tools = H5Lexists(file, "/tools", H5P_DEFAULT) > 0 ? TOOLS : 0;
    for (int kind = 0; kind < 2; kind++) {
        for (int i = 0; !fault && names[kind][i]; i++)
            fault = check_rows(file, names[kind][i], &count[kind], i == 0);
        if (!fault && kind == 0 && H5Lexists(file, "/exchange", H5P_DEFAULT) > 0)
            fault = check_rows(file, "/exchange", &count[kind], false);
        for (int i = 0; !fault && tools && kind == 1 && i < 3; i++)
            fault = check_rows(file, several_names[i], &count[kind], false);
        for (int k = 0; k < tools; k++)
            for (int i = 0; !fault && tool_names[kind][i]; i++) {
                char name[40];
                snprintf(name, sizeof name, "/tools/%d/%s", k, tool_names[kind][i]);
                fault = check_rows(file, name, &count[kind], false);
            }
    }
    hsize_t rows = 0, values = 0, poses = HSIZE_UNDEF;
    if (!fault && H5Lexists(file, "/motion", H5P_DEFAULT) > 0) {
        hid_t motion = H5Gopen2(file, "/motion", H5P_DEFAULT);
        if (H5Ovisit(motion, H5_INDEX_NAME, H5_ITER_INC, check_motion, &poses) < 0 || poses < count[1])
            fault = "motion cannot be read, or is shorter than the frames";
        H5Gclose(motion);
    }
    double *step = fault ? NULL : read_rows(file, "/wire/step", &rows, &values);
    rows = count[1] < rows ? count[1] : rows;      // with several tools the pages of a kind may be a flush apart
    if (step && rows > 0 && count[1] > 0 && text_of_scene == scene_text && step[rows - 1] >= (double)count[0])
        fault = "a frame of a step that is not there";
    free(step);
    H5Fclose(file);
    return fault;
}

// --- every state of the file in a flush ---

typedef struct Observed {
    char path[256], copy[256];
    int states, failures, commits, most_writes, writes;
    int every, first;           // the states that are read, besides the first and those at the end of a flush
    hsize_t before[2];          // rows of the last commit
    off_t length, end;          // length of the file and end in the superblock, after the last commit
    const char *fault;
    atomic_llong committed;
} Observed;

static off_t length_of(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 ? status.st_size : -1;
}

// The end of file in the superblock (version 1).
static off_t stated_end(const char *path)
{
    uint64_t end = UINT64_MAX;
    FILE *file = fopen(path, "rb");
    if (file && fseek(file, 44, SEEK_SET) == 0 && fread(&end, sizeof end, 1, file) != 1)
        end = UINT64_MAX;
    if (file)
        fclose(file);
    return (off_t)end;
}

// The end of the last chunk.
static off_t used_end(const char *path)
{
    off_t most = 0;
    hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    for (int i = 0; i < 2; i++) {
        hid_t set = H5Dopen2(file, i ? "/contact/vessel_node" : "/report/flags", H5P_DEFAULT), space = H5Dget_space(set);
        hsize_t chunks = 0, offset[3], size;
        haddr_t address;
        H5Dget_num_chunks(set, space, &chunks);
        for (hsize_t k = 0; k < chunks; k++)
            if (H5Dget_chunk_info(set, space, k, offset, NULL, &address, &size) >= 0 && (off_t)(address + size) > most)
                most = (off_t)(address + size);
        H5Sclose(space);
        H5Dclose(set);
    }
    H5Fclose(file);
    return most;
}

// Called in the recording's thread: checks the file as a kill at this moment would leave it.
static void look(void *context, bool done)
{
    Observed *watched = context;
    hsize_t count[2] = {0, 0};
    if (access(watched->path, F_OK) != 0)
        return;      // the file has no name yet
    if (!done && watched->states > 0 && watched->states % watched->every != watched->first) {     // the same writes are made
        watched->states++;
        watched->writes++;
        return;
    }
    const char *fault = copy_file(watched->path, watched->copy) ? check_file(watched->copy, count) : "no copy";
    if (watched->states == 0) {   // when it got its name
        memcpy(watched->before, count, sizeof count);
        watched->length = length_of(watched->copy);
        watched->end = stated_end(watched->copy);
    }
    // a reader may have read the length before this flush
    off_t end = stated_end(watched->copy);
    if (!fault && (end <= 0 || end > watched->length))
        fault = "an end that was not true a flush ago";
    if (!fault && used_end(watched->copy) > watched->end)
        fault = "chunks beyond the end of a flush ago";
    // the steps' page is written before the frames', which of a single tool is the last
    if (!fault && !done && count[1] != watched->before[1] && text_of_scene == scene_text)
        fault = "rows before the last write of the flush";
    if (!fault && (count[0] < watched->before[0] || count[1] < watched->before[1]))
        fault = "fewer rows than before";
    watched->states++;
    watched->writes++;
    if (fault) {
        watched->failures++;
        watched->fault = watched->fault ? watched->fault : fault;
    }
    if (done) {
        watched->most_writes = watched->writes > watched->most_writes ? watched->writes : watched->most_writes;
        watched->writes = 0;
        watched->commits++;
        memcpy(watched->before, count, sizeof count);
        watched->length = length_of(watched->copy);
        watched->end = end;
        atomic_store(&watched->committed, (long long)count[0]);
    }
}

static void look_at_states(const RecordingOptions *given, int every, int first)
{
    static Observed watched;
    watched = (Observed){.every = every, .first = first};
    snprintf(watched.path, sizeof watched.path, "%s/states.h5", folder);
    snprintf(watched.copy, sizeof watched.copy, "%s/state.h5", folder);
    unlink(watched.path);
    Scene *scene;
    Simulator *simulator = make_simulator(&scene);
    RecordingOptions options = *given;
    is_rounded = options.pose_ms > 0;
    options.flush_s = 0.01;
    options.expected_steps = 60;   // chunks of 10 steps and of one frame, of which a leaf of the index holds 16
    ordered_file_watch(look, &watched);
    Recording *recording = recording_create(watched.path, simulator, &options, &faults);
    assert_non_null(recording);
    for (int step = 1; step <= 180; step++) {
        ToolCommands commands = hands_at(step);
        simulator_step(simulator, &commands);
        assert_true(recording_step(recording, simulator, &commands, NULL));
        if (step == 10) {
            // the file gets its name with the first chunks
            while (access(watched.path, F_OK) != 0)
                nap_ms(1);
        } else if (step > 10 && step % 10 == 0) {
            while (atomic_load(&watched.committed) < step && watched.failures == 0)
                nap_ms(1);
        }
    }
    assert_true(recording_close(recording, simulator, &faults));
    ordered_file_watch(NULL, NULL);
    simulator_destroy(simulator);
    scene_free(scene);
    print_message("%d states of the file in %d flushes, %d of them no whole file\n", watched.states, watched.commits, watched.failures);
    if (watched.failures > 0)
        fail_msg("%s", watched.fault);
    assert_true(watched.commits >= 17);
    // a new leaf for each of fourteen datasets: the end of file, the leaf, its neighbour's link, entry and count of the root, extents
    assert_true(watched.most_writes > 1 + 14 * 4 + 1);
    assert_int_equal(watched.before[0], 180);
    assert_int_equal(watched.before[1], options.pose_ms > 0 ? 4 : 19);
    assert_null(check_file(watched.path, watched.before));
    assert_true(length_of(watched.path) == stated_end(watched.path));
    is_rounded = false;
}

static void every_state_in_a_flush_is_a_whole_file(void **state)
{
    (void)state;
    const RecordingOptions run = recording_default_options();
    RecordingOptions session = recording_session_options();
    session.frame_ms = 50;
    look_at_states(&run, WHOLE_OR_SHORT(1, 6), 0);
    look_at_states(&session, WHOLE_OR_SHORT(1, 6), 0);
}

static void so_it_is_with_several_tools(void **state)
{
    (void)state;
    NEED_WHOLE_RUNS();       // five thousand states, of which each run reads another third
    const RecordingOptions run = recording_default_options();
    RecordingOptions session = recording_session_options();
    session.frame_ms = 50;
    text_of_scene = tools_text;
    look_at_states(&run, 3, 0);
    look_at_states(&session, 3, 1);
    text_of_scene = devices_text;
    look_at_states(&run, 3, 2);
    text_of_scene = scene_text;
}

// --- kills ---

static void kill_recordings(int trials)
{
    unsigned seed = trials > 100 ? (unsigned)time(NULL) : 7;
    for (int trial = 0; trial < trials; trial++) {
        char path[256];
        snprintf(path, sizeof path, "%s/kill-%d.h5", folder, trial);
        static const char *const texts[] = {scene_text, tools_text, scene_text, devices_text};
        text_of_scene = texts[trial / 2 % 4];
        pid_t child = fork();
        assert_true(child >= 0);
        if (child == 0)
            record_for_ever(path, trial % 4 == 0 ? 1000000 : 300);   // chunks that last longer than a slow reader needs, or so small that a border is reached
        // the name appears with the first flush
        for (int waited = 0; access(path, F_OK) != 0 && waited < 10000; waited++)
            nap_ms(1);
        seed = seed * 1103515245 + 12345;
        nanosleep(&(struct timespec){.tv_nsec = seed / 65536 % 30000 * 3000}, NULL);
        if (trial % 4 == 0)
            assert_true(load_rows(path) > 0);   // readable while it is written
        kill(child, SIGKILL);
        int status;
        waitpid(child, &status, 0);
        assert_true(WIFSIGNALED(status));
        hsize_t count[2];
        const char *fault = check_file(path, count);
        if (fault)
            fail_msg("trial %d: %s", trial, fault);
        assert_true(load_rows(path) == (int64_t)count[0] && count[0] > 0);
        unlink(path);
        glob_t found;
        snprintf(path, sizeof path, "%s/kill-%d.h5.part*", folder, trial);
        assert_int_equal(glob(path, 0, NULL, &found), GLOB_NOMATCH);
    }
    text_of_scene = scene_text;
}

static void a_kill_leaves_a_file_that_opens(void **state)
{
    (void)state;
    kill_recordings(WHOLE_OR_SHORT(8, 4));
}

static void a_full_index_leaves_what_was_flushed(void **state)
{
    (void)state;
    char path[256];
    snprintf(path, sizeof path, "%s/index.h5", folder);
    Scene *scene;
    Simulator *simulator = make_simulator(&scene);
    RecordingOptions options = recording_default_options();
    options.expected_steps = 2;   // 256 chunks of one
    options.flush_s = 0;
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        Recording *recording = recording_create(path, simulator, &options, &faults);
        for (int step = 0; recording && step < 600; step++) {
            simulator_step_one_tool(simulator, (Command){0, 0});
            recording_step(recording, simulator, &(ToolCommands){0}, NULL);
            if (step % 100 == 0)
                nap_ms(30);
        }
        bool closed = recording && recording_close(recording, simulator, &faults);
        _exit(recording && !closed && faults.count == 1 && strstr(faults.text[0], "index is full") ? 0 : 2);
    }
    int status;
    waitpid(child, &status, 0);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
    hsize_t count[2];
    assert_null(check_file(path, count));
    assert_true(count[0] > 0 && count[0] <= 512);
    simulator_destroy(simulator);
    scene_free(scene);
}

static void a_full_disk_leaves_what_was_flushed(void **state)
{
    (void)state;
    char path[256];
    snprintf(path, sizeof path, "%s/full.h5", folder);
    enum { LARGEST = WHOLE_OR_SHORT(4, 2) << 20 };
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        // no file may grow beyond this: writing fails as on a full disk
        signal(SIGXFSZ, SIG_IGN);
        setrlimit(RLIMIT_FSIZE, &(struct rlimit){LARGEST, LARGEST});
        Scene *scene;
        Simulator *simulator = make_simulator(&scene);
        RecordingOptions options = recording_default_options();
        options.flush_s = 0.02;
        options.expected_steps = 200000;
        Recording *recording = recording_create(path, simulator, &options, &faults);
        if (!recording)
            _exit(1);
        int64_t steps = 0;
        for (; steps < 1000000; steps++) {
            simulator_step_one_tool(simulator, (Command){0, 0});
            if (!recording_step(recording, simulator, &(ToolCommands){0}, NULL))
                break;
        }
        bool closed = recording_close(recording, simulator, &faults);
        _exit(steps < 1000000 && !closed && faults.count == 1 && strstr(faults.text[0], "full.h5: recording stopped") ? 0 : 2);
    }
    int status;
    waitpid(child, &status, 0);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
    hsize_t count[2];
    assert_null(check_file(path, count));
    assert_true(count[0] > WHOLE_OR_SHORT(2000, 500) && load_rows(path) == (int64_t)count[0]);
}

static void what_is_no_recording_is_reported(void **state)
{
    (void)state;
    char path[256];
    snprintf(path, sizeof path, "%s/none.h5", folder);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs("nothing", file);
    fclose(file);
    faults_clear(&faults);
    assert_null(recorded_run_load(path, &faults));
    assert_null(recorded_run_load("/nowhere/x.h5", &faults));
    hid_t empty = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    H5Fclose(empty);
    assert_null(recorded_run_load(path, &faults));
    assert_true(faults.count >= 3);
    faults_clear(&faults);
    Scene *scene;
    Simulator *simulator = make_simulator(&scene);
    RecordingOptions options = recording_default_options();
    assert_null(recording_create("/nowhere/x.h5", simulator, &options, &faults));
    assert_int_equal(faults.count, 1);
    simulator_destroy(simulator);
    scene_free(scene);
}

static int set_up(void **state)
{
    recording_prepare_process();
    return make_folder(state);
}

static int most_kills;
static void kills_at_random(void **state)
{
    (void)state;
    kill_recordings(most_kills);
}

int main(int count, char **argument)
{
    if (count == 2 && (most_kills = atoi(argument[1])) > 0)
        return cmocka_run_group_tests(((const struct CMUnitTest[]){cmocka_unit_test(kills_at_random)}), set_up, remove_folder);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_read_is_what_was_simulated),
        cmocka_unit_test(what_is_read_of_several_tools),
        cmocka_unit_test(what_is_read_of_a_session),
        cmocka_unit_test(what_is_read_of_exchanged_tools),
        cmocka_unit_test(what_is_broken_is_refused),
        cmocka_unit_test(one_chunk_is_not_read_many_times),
        cmocka_unit_test(every_state_in_a_flush_is_a_whole_file),
        cmocka_unit_test(so_it_is_with_several_tools),
        cmocka_unit_test(a_kill_leaves_a_file_that_opens),
        cmocka_unit_test(a_full_index_leaves_what_was_flushed),
        cmocka_unit_test(a_full_disk_leaves_what_was_flushed),
        cmocka_unit_test(what_is_no_recording_is_reported),
    };
    return cmocka_run_group_tests(tests, set_up, remove_folder);
}
