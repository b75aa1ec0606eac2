#include "render/sweep_worst.h"

#include "render/page.h"
#include "render/silhouette.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// The figure by which runs are worst, the first of these that the table has and that varies.
static const struct {
    const char *name, *words;
    bool less_is_worse;
} measure[] = {{"score.points", "those with the fewest points", true},
               {"golden.worst_mm", "those farthest from the golden path", false},
               {"targets[0].distance_mm", "those whose tip stays farthest from the first target", false},
               {"penetration_mm.max", "those that penetrate the wall most", false},
               {"wall_force_n.max", "those with the largest force on the wall", false}};
enum { MEASURES = sizeof measure / sizeof measure[0] };

typedef struct Ranked {
    int row, status;
    double badness;
} Ranked;

static int compare_runs(const void *a, const void *b)
{
    const Ranked *p = a, *q = b;
    if (p->status != q->status)
        return q->status - p->status;
    return p->badness != q->badness ? (p->badness > q->badness ? -1 : 1) : p->row - q->row;
}

static int status_of(const SweepResults *results, int row)
{
    int k = 0;
    while (run_status_name[k] && strcmp(run_status_name[k], results->column[results->status].text[row]))
        k++;
    return k;
}

// --- the picture ---

static void draw_targets(FILE *out, const Silhouette *view, const Scene *scene)
{
    for (int i = 0; i < scene->target_count; i++)
        fprintf(out, "<circle class=\"mark o2\" cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\"/>\n", silhouette_x(view, scene->target[i].point),
                silhouette_y(view, scene->target[i].point), fmax(scene->target[i].radius * view->scale, 3));
}

static void draw_last(FILE *out, const RecordedRun *run, const Scene *scene, const CheckWall *wall, int row)
{
    RecordedFrame last = recorded_run_frame(run, run->frame_count - 1);
    Vec3 low = last.position[last.node_count - 1], high = low;
    for (int i = 0; i < scene->target_count; i++)
        silhouette_widen(scene->target[i].point, &low, &high);
    // what is in the vessel: the inserted length from the tip backwards
    double shown = last.s[last.node_count - 1] - run->inserted[run->step_count - 1];
    int first = last.node_count - 1;
    while (first > 0 && last.s[first - 1] >= shown)
        silhouette_widen(last.position[--first], &low, &high);
    Silhouette view = silhouette_frame(low, high, 240);
    char id[40];
    snprintf(id, sizeof id, "worst-%d", row);
    silhouette_begin(out, &view, id, "The end of the run");
    silhouette_wall(out, &view, wall);
    fprintf(out, "<polyline class=\"line o1\" points=\"");
    for (int i = first; i < last.node_count; i++)
        fprintf(out, "%.1f,%.1f ", silhouette_x(&view, last.position[i]), silhouette_y(&view, last.position[i]));
    fprintf(out, "\"/>\n");
    draw_targets(out, &view, scene);
    silhouette_end(out, &view);
}

static void draw_picture(FILE *out, const SweepPage *page, int row)
{
    char path[4200];
    OpenVessel open = {0};
    CheckWall wall = {0};
    Faults *faults = HEAP_ZEROED(1, sizeof *faults);
    snprintf(path, sizeof path, "%.4000s/recordings/%d.h5", page->folder, row);
    RecordedRun *run = access(path, F_OK) == 0 ? recorded_run_load(path, faults) : NULL;
    Scene *scene = run && run->scene_text ? scene_parse(run->scene_text, strlen(run->scene_text), run->scene_path ? run->scene_path : "scene", faults) : NULL;
    if (scene && run->frame_count > 0 && run->step_count > 0 && open_vessel(scene, &(OpenVesselOptions){0}, &open, faults)) {
        check_wall_copy(&wall, scene, &open);
        draw_last(out, run, scene, &wall, row);
    } else {
        fprintf(out, "<p>No picture: ");
        page_text(out, faults->count > 0 ? faults->text[0] : "it was not recorded");
        fprintf(out, ".</p>");
    }
    check_wall_free(&wall);
    open_vessel_close(&open);
    scene_free(scene);
    recorded_run_free(run);
    free(faults);
}

static void print_run(FILE *out, const SweepPage *page, const Ranked *ranked, int by)
{
    const SweepResults *results = page->results;
    int row = ranked->row;
    fprintf(out, "<article class=\"run\"><h3>Run %d: ", row);
    page_text(out, results->column[results->status].text[row]);
    fprintf(out, "</h3>");
    draw_picture(out, page, row);
    fprintf(out, "<dl>");
    for (int c = results->key_first; c < results->figure_first; c++) {
        if (c == results->status || !*results->column[c].text[row])
            continue;
        fprintf(out, "<dt>");
        page_text(out, results->column[c].name);
        fprintf(out, "</dt><dd>");
        page_text(out, results->column[c].text[row]);
        fprintf(out, "</dd>");
    }
    if (by >= 0 && !isnan(results->column[by].value[row])) {
        fprintf(out, "<dt>");
        page_text(out, results->column[by].name);
        fprintf(out, "</dt><dd>%.6g</dd>", results->column[by].value[row]);
    }
    fprintf(out, "</dl><pre>seldinger sweep ");
    page_text(out, page->path ? page->path : "SPEC.yaml");
    fprintf(out, " --run %d -o run-%d</pre></article>\n", row, row);
}

// The index of the figure that judges the runs, and its place in `measure`; -1: the table has none.
static int find_measure(const SweepResults *results, int *m)
{
    for (*m = 0; *m < MEASURES; ++*m) {
        int by = sweep_results_find(results, measure[*m].name);
        if (by >= 0 && sweep_results_is_figure(results, by) && results->column[by].varies)
            return by;
    }
    return -1;
}

// All runs, the worst first; the caller frees them.
static Ranked *rank(const SweepResults *results, int by, int m)
{
    Ranked *ranked = HEAP_ZEROED((size_t)results->row_count + 1, sizeof *ranked);
    for (int i = 0; i < results->row_count; i++) {
        double value = by >= 0 ? results->column[by].value[i] : 0;
        ranked[i] = (Ranked){i, status_of(results, i), isnan(value) ? HUGE_VAL : by >= 0 && measure[m].less_is_worse ? -value : value};
    }
    qsort(ranked, (size_t)results->row_count, sizeof *ranked, compare_runs);
    return ranked;
}

int sweep_worst_runs(const SweepResults *results, int rows[SWEEP_WORST_MOST])
{
    int m, by = find_measure(results, &m), count = results->row_count < SWEEP_WORST_MOST ? results->row_count : SWEEP_WORST_MOST;
    Ranked *ranked = rank(results, by, m);
    for (int i = 0; i < count; i++)
        rows[i] = ranked[i].row;
    free(ranked);
    return count;
}

void sweep_worst_section(FILE *out, const SweepPage *page)
{
    const SweepResults *results = page->results;
    int m, by = find_measure(results, &m);
    Ranked *ranked = rank(results, by, m);
    fprintf(out, "<section id=\"worst\"><h2>The worst runs</h2>\n<p>First runs that failed, left the vessel or diverged; then %s.</p>\n<div class=\"worst\">",
            by >= 0 ? measure[m].words : "by number, because the table has no figure to judge them by");
    for (int i = 0; i < results->row_count && i < SWEEP_WORST_MOST; i++)
        print_run(out, page, &ranked[i], by);
    fprintf(out, "</div></section>\n");
    free(ranked);
}
