// The session report's figures: strips over time, the tip's path in the C-arm's view, points over sessions. Colours are classes of page_style or, for
// the path, steps of viridis' darker part, whose lightness grows with time, which the colour-blind can distinguish, also in print.
#include "render/session_figures.h"

#include "render/camera.h"
#include "render/page.h"
#include "render/tick_step.h"

#include <stdlib.h>
#include <string.h>

static const char error_letter[] = "WTFBXCLKMPDSO";
_Static_assert(sizeof error_letter == ERROR_COUNT + 1, "each error has its letter");
char session_error_letter(ScoreError kind) { return error_letter[kind]; }

// --- strips over time ---

enum { COLUMNS = 800, STRIP = 84, STRIP_GAP = 30, STRIP_LEFT = 62, STRIP_TOP = 34, BARS = 14 };

typedef double Series(const RecordedRun *run, int64_t i);
static double inserted_of(const RecordedRun *run, int64_t i) { return run->inserted[i]; }
static double force_of(const RecordedRun *run, int64_t i) { return run->proximal[2 * i]; }
static double torque_of(const RecordedRun *run, int64_t i) { return run->proximal[2 * i + 1]; }
static double wall_of(const RecordedRun *run, int64_t i) { return run->wall_force[2 * i]; }
static bool pedal_of(const RecordedRun *run, int64_t i) { return run->xray[i].pedal > 0.5F; }
static bool contrast_of(const RecordedRun *run, int64_t i) { return run->xray[i].contrast_ml_s > 0; }

typedef struct Strip {
    const char *name;
    Series *series;
    int colour;              // class o1 …
} Strip;

typedef struct TimeAxis {
    double end_s;
} TimeAxis;

static double at_time(const TimeAxis *axis, double t) { return STRIP_LEFT + COLUMNS * fmin(fmax(t / axis->end_s, 0), 1); }

// Every column of pixels shows the least and the largest of its steps, so that a peak of one step is seen.
static void draw_strip(FILE *out, const RecordedRun *run, const Strip *strip, int top)
{
    double low[COLUMNS], high[COLUMNS], least = 0, most = 0;
    int columns = 0;
    int64_t steps = run->step_count;
    for (int c = 0; c < COLUMNS; c++) {
        int64_t from = steps * c / COLUMNS, to = steps * (c + 1) / COLUMNS;
        low[c] = HUGE_VAL, high[c] = -HUGE_VAL;
        for (int64_t i = from; i < (to > from ? to : from + 1) && i < steps; i++) {
            double value = strip->series(run, i);
            low[c] = fmin(low[c], value);
            high[c] = fmax(high[c], value);
        }
        least = fmin(least, low[c]);
        most = fmax(most, high[c]);
        columns = c + 1;
    }
    double range = fmax(most - least, 1e-6), tick = tick_step(range, 4), floor_at = tick * floor(least / tick), scale;
    range = fmax(tick * ceil(most / tick) - floor_at, tick);
    scale = STRIP / range;
    fprintf(out, "<text x=\"%d\" y=\"%d\">%s</text>\n", STRIP_LEFT, top - 6, strip->name);
    for (int k = 0; k * tick <= range * (1 + 1e-9); k++) {
        double y = top + STRIP - k * tick * scale;
        fprintf(out, "<path class=\"grid\" d=\"M%d %.1f h%d\"/><text class=\"tick\" text-anchor=\"end\" x=\"%d\" y=\"%.1f\">%g</text>\n", STRIP_LEFT, y,
                COLUMNS, STRIP_LEFT - 6, y + 4, fabs(floor_at + k * tick) < 1e-9 * range ? 0 : floor_at + k * tick);
    }
    fprintf(out, "<path class=\"line o%d\" d=\"M", strip->colour);
    for (int c = 0; c < columns; c++)
        fprintf(out, "%d %.1f V%.1f L", STRIP_LEFT + c, top + STRIP - (high[c] - floor_at) * scale, top + STRIP - (low[c] - floor_at) * scale);
    fprintf(out, "%d %.1f\"/>\n", STRIP_LEFT + columns - 1, top + STRIP - (low[columns - 1] - floor_at) * scale);
}

static void draw_bars(FILE *out, const RecordedRun *run, const TimeAxis *axis, const char *name, bool (*is_on)(const RecordedRun *, int64_t), int colour,
                      int top)
{
    fprintf(out, "<text class=\"tick\" text-anchor=\"end\" x=\"%d\" y=\"%d\">%s</text><path class=\"grid\" d=\"M%d %d h%d\"/><g class=\"o%d\">", STRIP_LEFT - 6,
            top + 11, name, STRIP_LEFT, top + BARS, COLUMNS, colour);
    for (int64_t i = 0; i < run->step_count;) {
        int64_t from = i;
        if (!is_on(run, i++))
            continue;
        while (i < run->step_count && is_on(run, i))
            i++;
        double x = at_time(axis, run->time_s[from] - run->step_ms / 1000), width = at_time(axis, run->time_s[i - 1]) - x;
        fprintf(out, "<rect class=\"bar\" x=\"%.1f\" y=\"%d\" width=\"%.1f\" height=\"%d\"/>", x, top, fmax(width, 0.7), BARS);
    }
    fprintf(out, "</g>\n");
}

// Dashed lines through all strips with their letters on top; letters that would touch move up to a second line or are left out.
static void draw_errors(const SessionPage *page, const TimeAxis *axis, int bottom)
{
    double last[2] = {-1e9, -1e9};
    for (int i = 0; i < page->session->event_count; i++) {
        double x = at_time(axis, page->session->event[i].time_s);
        int row = x - last[0] >= 11 ? 0 : x - last[1] >= 11 ? 1 : -1;
        fprintf(page->out, "<path class=\"error\" d=\"M%.1f %d V%d\"/>", x, STRIP_TOP - 14, bottom);
        if (row < 0)
            continue;
        last[row] = x;
        fprintf(page->out, "<text class=\"error label\" text-anchor=\"middle\" x=\"%.1f\" y=\"%d\">%c</text>\n", x, STRIP_TOP - 18 - 12 * row,
                session_error_letter(page->session->event[i].kind));
    }
}

void session_time_figure(const SessionPage *page)
{
    static const Strip strip[] = {{"Inserted length [mm]", inserted_of, 3},
                                  {"Push force at the hand [N]", force_of, 1},
                                  {"Torque at the hand [N mm]", torque_of, 2},
                                  {"Largest wall force [N]", wall_of, 4}};
    enum { STRIPS = sizeof strip / sizeof strip[0] };
    const RecordedRun *run = page->run;
    FILE *out = page->out;
    if (!run || run->step_count < 1)
        return;
    TimeAxis axis = {run->time_s[run->step_count - 1]};
    int bottom = STRIP_TOP + STRIPS * (STRIP + STRIP_GAP), bars = run->xray ? 2 : 0, foot = bottom + bars * (BARS + 8), width = STRIP_LEFT + COLUMNS + 16;
    fprintf(out,
            "<figure id=\"figure-time\"><svg role=\"img\" aria-labelledby=\"time-t time-d\" viewBox=\"0 0 %d %d\" width=\"%d\" height=\"%d\">\n"
            "<title id=\"time-t\">The session over time</title><desc id=\"time-d\">Inserted length, push force, torque and largest wall force over %.1f s, "
            "with %d errors marked.</desc>\n",
            width, foot + 36, width, foot + 36, axis.end_s, page->session->event_count);
    for (int i = 0; i < STRIPS; i++)
        draw_strip(out, run, &strip[i], STRIP_TOP + 18 + i * (STRIP + STRIP_GAP));
    if (run->xray) {
        draw_bars(out, run, &axis, "pedal", pedal_of, 2, bottom + 6);
        draw_bars(out, run, &axis, "contrast", contrast_of, 1, bottom + 6 + BARS + 8);
    }
    draw_errors(page, &axis, foot + 4);
    double tick = tick_step(axis.end_s, 10);
    for (int k = 0; k * tick <= axis.end_s * (1 + 1e-9); k++)
        fprintf(out, "<path class=\"axis\" d=\"M%.1f %d v4\"/><text class=\"tick\" text-anchor=\"middle\" x=\"%.1f\" y=\"%d\">%g</text>\n",
                at_time(&axis, k * tick), foot + 4, at_time(&axis, k * tick), foot + 19, k * tick);
    fprintf(out,
            "<text class=\"tick\" text-anchor=\"end\" x=\"%d\" y=\"%d\">time [s]</text>\n</svg>\n<figcaption>Each column of pixels spans the least and the "
            "largest value of its steps. Dashed lines are errors, their letters as in the list above.%s</figcaption></figure>\n",
            STRIP_LEFT + COLUMNS, foot + 33, run->xray ? "" : " The recording has no X-ray controls.");
}

// --- the path over the roadmap ---

enum { VIEW_WIDTH = 640, VIEW_BORDER = 26, PATH_STEPS = 24, PATH_POINTS = 1500 };

typedef struct RoadMap {
    CArm arm;
    char label[32];
    double left, top, scale; // picture of c_arm_project to pixels
    double height;
    double mm;               // pixels a mm at the isocentre
} RoadMap;

// The view that the trainee had for most of the fluoroscopy; frontal where there was none.
static XrayControl usual_view(const RecordedRun *run)
{
    XrayControl best = xray_default_control();
    int64_t most = 0, from = 0;
    for (int64_t i = 1; run->xray && i <= run->step_count; i++) {
        bool is_same_view = i < run->step_count && run->xray[i].lao_deg == run->xray[from].lao_deg && run->xray[i].cra_deg == run->xray[from].cra_deg;
        if (is_same_view)
            continue;
        int64_t seen = 0;
        for (int64_t k = from; k < i; k++)
            seen += pedal_of(run, k);
        if (seen > most) {
            most = seen;
            best.lao_deg = run->xray[from].lao_deg;
            best.cra_deg = run->xray[from].cra_deg;
        }
        from = i;
    }
    return best;
}

static Vec3 tip_at(const RecordedRun *run, int64_t frame)
{
    RecordedFrame at = recorded_run_frame(run, frame);
    return at.position[at.node_count - 1];
}

static void place(const RoadMap *map, Vec3 point, double *x, double *y)
{
    Vec3 at = c_arm_project(&map->arm, point);
    *x = map->left + map->scale * at.x;
    *y = map->top - map->scale * at.y;
}

static void widen(const RoadMap *map, Vec3 point, double margin, double box[4])
{
    Vec3 at = c_arm_project(&map->arm, point);
    double around = margin / map->arm.field_mm;
    box[0] = fmin(box[0], at.x - around), box[1] = fmax(box[1], at.x + around);
    box[2] = fmin(box[2], at.y - around), box[3] = fmax(box[3], at.y + around);
}

// As the trainer has it: what the scene says; shapes and tubes, which lie in no patient, are seen face on from the front.
static PatientAxes patient_of(const Scene *scene, const VesselTree *tree)
{
    if (scene && vec3_norm(scene->patient_superior) > 0)
        return (PatientAxes){
            .right = vec3_cross(scene->patient_anterior, scene->patient_superior), .anterior = scene->patient_anterior, .superior = scene->patient_superior};
    if (!scene || !tree || (scene->source != SOURCE_SHAPE && scene->source != SOURCE_TUBE))
        return patient_axes_lps();
    Camera camera = {0};
    camera_orient(&camera, vec3(0, 0, 0), vec3(0, 0, 0), tree->node_count, tree->center);
    return (PatientAxes){.right = vec3_negate(camera.right), .anterior = camera.back, .superior = camera.up};
}

// Frames the tip's path and the target.
static RoadMap frame_path(const SessionPage *page)
{
    const RecordedRun *run = page->run;
    RoadMap map = {.scale = 1};
    XrayControl view = usual_view(run);
    Vec3 low = tip_at(run, 0), high = low;
    PatientAxes axes = patient_of(page->scene, page->tree);
    double box[4] = {HUGE_VAL, -HUGE_VAL, HUGE_VAL, -HUGE_VAL};
    for (int64_t i = 0; i < run->frame_count; i++) {
        Vec3 p = tip_at(run, i);
        low = vec3(fmin(low.x, p.x), fmin(low.y, p.y), fmin(low.z, p.z));
        high = vec3(fmax(high.x, p.x), fmax(high.y, p.y), fmax(high.z, p.z));
    }
    Vec3 middle = vec3_mix(low, high, 0.5);
    view.table_mm[0] = (float)middle.x, view.table_mm[1] = (float)middle.y, view.table_mm[2] = (float)middle.z;
    map.arm = c_arm_place(&view, &axes);
    c_arm_label(&view, map.label);
    double margin = 3 + 0.05 * vec3_distance(low, high);
    for (int64_t i = 0; i < run->frame_count; i++)
        widen(&map, tip_at(run, i), margin, box);
    if (page->scene && page->scene->exercise) {
        const SceneTarget *target = &page->scene->target[page->scene->exercise->target];
        widen(&map, target->point, target->radius + 2, box);
    }
    map.scale = (VIEW_WIDTH - 2 * VIEW_BORDER) / fmax(box[1] - box[0], 0.6 * (box[3] - box[2]));
    map.mm = map.scale / map.arm.field_mm;
    map.height = map.scale * (box[3] - box[2]) + 2 * VIEW_BORDER;
    map.left = 0.5 * VIEW_WIDTH - 0.5 * map.scale * (box[0] + box[1]);
    map.top = VIEW_BORDER + map.scale * box[3];
    return map;
}

// Links as strokes as wide as the vessel with round ends, all of one colour in one group: together the silhouette.
static void draw_vessel(FILE *out, const RoadMap *map, const VesselTree *tree)
{
    fprintf(out, "<g class=\"vessel\">");
    for (int i = 0; i < tree->node_count; i++) {
        int from = tree->parent[i] >= 0 ? tree->parent[i] : i;
        double x, y, u, v, wide = 2 * tree->radius[i] * map->mm;
        place(map, tree->center[from], &u, &v);
        place(map, tree->center[i], &x, &y);
        if (fmax(x, u) < -wide || fmin(x, u) > VIEW_WIDTH + wide || fmax(y, v) < -wide || fmin(y, v) > map->height + wide)
            continue;
        if (tree->kind[i] == NODE_ANEURYSM)
            fprintf(out, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\"/>", x, y, 0.5 * wide);
        else
            fprintf(out, "<path stroke-width=\"%.1f\" d=\"M%.1f %.1fL%.1f %.1f\"/>", wide, u, v, x, y);
    }
    fprintf(out, "</g>\n");
}

// viridis from its dark end to three quarters, by five of its colours.
static void time_colour(double part, char text[8])
{
    static const double colour[5][3] = {{72, 20, 103}, {62, 74, 137}, {38, 130, 142}, {53, 183, 121}, {145, 213, 66}};
    double at = 4 * fmin(fmax(part, 0), 1);
    int k = at < 4 ? (int)at : 3;
    double c[3];
    for (int i = 0; i < 3; i++)
        c[i] = colour[k][i] + (at - k) * (colour[k + 1][i] - colour[k][i]);
    snprintf(text, 8, "#%02x%02x%02x", (unsigned)c[0] & 255U, (unsigned)c[1] & 255U, (unsigned)c[2] & 255U);
}

static void draw_path(FILE *out, const RoadMap *map, const RecordedRun *run)
{
    int64_t stride = run->frame_count / PATH_POINTS + 1;
    for (int halo = 1; halo >= 0; halo--)
        for (int k = 0; k < PATH_STEPS; k++) {
            char colour[8];
            int64_t from = run->frame_count * k / PATH_STEPS, to = run->frame_count * (k + 1) / PATH_STEPS;
            time_colour((k + 0.5) / PATH_STEPS, colour);
            if (halo)
                fprintf(out, "<polyline class=\"halo\" points=\"");
            else
                fprintf(out, "<polyline class=\"way\" stroke=\"%s\" points=\"", colour);
            for (int64_t i = from; i <= to && i < run->frame_count; i = i < to && i + stride > to ? to : i + stride) {
                double x, y;
                place(map, tip_at(run, i), &x, &y);
                fprintf(out, "%.1f,%.1f ", x, y);
                if (i == to)
                    break;
            }
            fprintf(out, "\"/>\n");
        }
}

static void draw_tool(FILE *out, const RoadMap *map, const RecordedRun *run)
{
    RecordedFrame at = recorded_run_frame(run, run->frame_count - 1);
    RecordedToolFrame first = {0};
    if (run->tool_count > 1)
        first = recorded_run_tool_frame(run, 0, run->frame_count - 1);
    double length = run->tool_count > 1 ? first.s[first.node_count - 1] : at.s[at.node_count - 1], shown = length - run->inserted[run->step_count - 1], x, y;
    fprintf(out, "<polyline class=\"tool\" points=\"");
    for (int i = 0; i < at.node_count; i++) {
        if (at.s[i] < shown)
            continue;
        place(map, at.position[i], &x, &y);
        fprintf(out, "%.1f,%.1f ", x, y);
    }
    fprintf(out, "\"/>\n");
}

static void draw_marks(const SessionPage *page, const RoadMap *map)
{
    FILE *out = page->out;
    const RecordedRun *run = page->run;
    double x, y;
    place(map, tip_at(run, 0), &x, &y);
    fprintf(out, "<circle class=\"root\" cx=\"%.1f\" cy=\"%.1f\" r=\"4\"><title>start</title></circle>\n", x, y);
    if (page->scene && page->scene->exercise) {
        const SceneTarget *target = &page->scene->target[page->scene->exercise->target];
        double r = fmax(target->radius * map->mm, 4);
        place(map, target->point, &x, &y);
        fprintf(out,
                "<g class=\"o2\"><circle class=\"mark\" cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\"/><path class=\"mark\" d=\"M%.1f %.1fh-6m%.1f 0h6\"/></g>"
                "<text class=\"label\" text-anchor=\"%s\" x=\"%.1f\" y=\"%.1f\">",
                x, y, r, x - r, y, 2 * r + 6, x > 0.6 * VIEW_WIDTH ? "end" : "start", x > 0.6 * VIEW_WIDTH ? x - r - 9 : x + r + 9, y + 4);
        page_text(out, target->name);
        fprintf(out, "</text>\n");
    }
    double last_x = -1e9, last_y = -1e9, shift = 0;
    for (int i = 0; i < page->session->event_count; i++) {
        int64_t low = 0, high = run->frame_count - 1;        // the first frame at or after it
        while (low < high) {
            int64_t at = (low + high) / 2;
            if (run->time_s[run->frame_step[at]] < page->session->event[i].time_s)
                low = at + 1;
            else
                high = at;
        }
        place(map, tip_at(run, low), &x, &y);
        shift = hypot(x - last_x, y - last_y) < 12 ? shift + 11 : 0;         // letters of one place stand side by side
        last_x = x, last_y = y;
        fprintf(out, "<circle class=\"error\" cx=\"%.1f\" cy=\"%.1f\" r=\"5\"/><text class=\"error label\" x=\"%.1f\" y=\"%.1f\">%c</text>\n", x, y,
                x + 7 + shift, y - 5, session_error_letter(page->session->event[i].kind));
    }
}

void session_path_figure(const SessionPage *page)
{
    const RecordedRun *run = page->run;
    FILE *out = page->out;
    if (!run || run->frame_count < 1)
        return;
    RoadMap map = frame_path(page);
    double bar = tick_step(VIEW_WIDTH / map.mm, 5), foot = map.height + 44, end_s = run->time_s[run->step_count - 1];
    fprintf(out,
            "<figure id=\"figure-path\"><svg role=\"img\" aria-labelledby=\"path-t path-d\" viewBox=\"0 0 %d %.0f\" width=\"%d\" height=\"%.0f\">\n"
            "<title id=\"path-t\">Path of the tip over the vessel</title><desc id=\"path-d\">The path of the tool's tip in %.1f s, seen in %s, over the "
            "vessel's silhouette, with target and errors.</desc>\n<svg class=\"view\" width=\"%d\" height=\"%.0f\">\n",
            VIEW_WIDTH, foot, VIEW_WIDTH, foot, end_s, map.label, VIEW_WIDTH, map.height);
    if (page->tree)
        draw_vessel(out, &map, page->tree);
    draw_tool(out, &map, run);
    draw_path(out, &map, run);
    draw_marks(page, &map);
    fprintf(out, "</svg><path class=\"axis\" d=\"M12 %.1f h%.1f m0 -4 v8 M12 %.1f v8\"/><text x=\"%.1f\" y=\"%.1f\">%g mm</text>\n", map.height + 18,
            bar * map.mm, map.height + 14, 12 + bar * map.mm + 6, map.height + 22, bar);
    for (int k = 0; k < PATH_STEPS; k++) {
        char colour[8];
        time_colour((k + 0.5) / PATH_STEPS, colour);
        fprintf(out, "<rect x=\"%.1f\" y=\"%.1f\" width=\"7.6\" height=\"8\" fill=\"%s\"/>", VIEW_WIDTH - 232 + 7.5 * k, map.height + 14, colour);
    }
    fprintf(out,
            "<text class=\"tick\" text-anchor=\"end\" x=\"%d\" y=\"%.1f\">0 s</text><text class=\"tick\" x=\"%d\" y=\"%.1f\">%.0f s</text><text class=\"tick\" "
            "x=\"12\" y=\"16\">%s</text>\n</svg>\n<figcaption>The tip's path by time, the tool at the end as a thin line, the target as a ring, the start as a "
            "dot, errors by their letters; the C-arm as it stood for most of the fluoroscopy.%s</figcaption></figure>\n",
            VIEW_WIDTH - 238, map.height + 22, VIEW_WIDTH - 46, map.height + 22, end_s, map.label,
            page->tree ? "" : " The vessel is not drawn: it is not a tree, or was not found.");
}

// --- earlier sessions ---

void session_trend_figure(const SessionPage *page)
{
    enum { WIDTH = 620, HEIGHT = 150, LEFT = 44, TOP = 16 };
    FILE *out = page->out;
    int count = page->earlier_count;
    if (count < 2)
        return;
    double step = count > 1 ? (double)(WIDTH - 20) / (count - 1) : 0;
    fprintf(out,
            "<figure id=\"figure-trend\"><svg role=\"img\" aria-labelledby=\"trend-t trend-d\" viewBox=\"0 0 %d %d\" width=\"%d\" height=\"%d\">\n"
            "<title id=\"trend-t\">Points over sessions</title><desc id=\"trend-d\">Points of %d sessions, from %.0f to %.0f.</desc>\n",
            WIDTH + LEFT + 16, HEIGHT + TOP + 36, WIDTH + LEFT + 16, HEIGHT + TOP + 36, count, page->earlier[0].figures.points,
            page->earlier[count - 1].figures.points);
    for (int k = 0; k <= 4; k++)
        fprintf(out, "<path class=\"grid\" d=\"M%d %d h%d\"/><text class=\"tick\" text-anchor=\"end\" x=\"%d\" y=\"%d\">%d</text>\n", LEFT,
                TOP + HEIGHT - HEIGHT * k / 4, WIDTH, LEFT - 6, TOP + HEIGHT - HEIGHT * k / 4 + 4, 25 * k);
    fprintf(out, "<polyline class=\"line o1\" points=\"");
    for (int i = 0; i < count; i++)
        fprintf(out, "%.1f,%.1f ", LEFT + 10 + step * i, TOP + HEIGHT * (1 - page->earlier[i].figures.points / 100));
    fprintf(out, "\"/>\n");
    for (int i = 0; i < count; i++) {
        const Session *s = &page->earlier[i];
        double x = LEFT + 10 + step * i, y = TOP + HEIGHT * (1 - s->figures.points / 100);
        bool reached = s->figures.state == SCORE_REACHED,
             own = !strcmp(s->series_sha256, page->session->series_sha256) && !strcmp(s->date, page->session->date);
        fprintf(out, "<circle class=\"%s\" cx=\"%.1f\" cy=\"%.1f\" r=\"%d\"/>", reached ? "held o1" : "missed o1", x, y, own ? 6 : 4);
        if (count <= 20 || i % (count / 10) == 0)
            fprintf(out, "<text class=\"tick\" text-anchor=\"middle\" x=\"%.1f\" y=\"%d\">%d</text>", x, TOP + HEIGHT + 15, i + 1);
    }
    fprintf(out,
            "<text class=\"tick\" text-anchor=\"end\" x=\"%d\" y=\"%d\">session</text></svg>\n<figcaption>Points by session, as numbered in the table; filled: "
            "target held, open: not; the large dot is this session.</figcaption></figure>\n",
            LEFT + WIDTH, TOP + HEIGHT + 30);
}
