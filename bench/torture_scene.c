#include "bench/torture_scene.h"

#include "geom/random.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

const char *const torture_vessel_name[TORTURE_VESSELS] = {"tube", "shape", "model"};
const char *const torture_tool_name[TORTURE_TOOLS] = {"straight wire", "J wire", "Simmons catheter", "pigtail catheter", "two to four tools"};

// Shapes that are fitted once and kept (SELDINGER_CACHE), with the radius at their inlet [mm].
static const struct {
    const char *text;
    double lumen;
} shape[] = {{"{name: phantom}", 1.8},
             {"{name: y, radius_mm: 1.5, length_mm: 25}", 1.5},
             {"{name: helix, radius_mm: 1.2, bend_radius_mm: 7, rise_mm: 16, turns: 2}", 1.2},
             {"{name: kissing, radius_mm: 1.2, gap_mm: 0.25}", 1.2},
             {"{name: tree, branches: 15, seed: 3}", 1.6},
             {"{name: tree, branches: 15, sacs: 2, seed: 8}", 1.6}};
enum { SHAPES = sizeof shape / sizeof shape[0] };

typedef struct Draws {
    Random random;
    FILE *out;
    double lumen;            // [mm] radius at the inlet
    double finer;            // 1, or 2: twice the elements, half the step
} Draws;

static double draw(Draws *draws, double low, double high) { return low + (high - low) * random_unit(&draws->random); }

static double draw_log(Draws *draws, double low, double high) { return exp(draw(draws, log(low), log(high))); }
static int draw_whole(Draws *draws, int count) { return (int)fmin(count - 1, floor(draw(draws, 0, count))); }

// --- the vessel ---

static void write_tube(Draws *draws)
{
    double radius = draw_log(draws, 0.6, 6);
    int arcs = 2 + draw_whole(draws, 6);
    draws->lumen = radius;
    fprintf(draws->out, "vessel: {tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], radius_mm: %.4f, path: [{line_mm: %.3f}", radius, draw(draws, 5, 30));
    for (int i = 0; i < arcs; i++) {
        double plane = draw(draws, -180, 180), angle = draw(draws, 15, 150), bend = 1.15 * radius + draw_log(draws, 2, 60);
        fprintf(draws->out, ", {arc: {radius_mm: %.4f, angle_deg: %.3f, plane_deg: %.3f}}", bend, angle, plane);
    }
    fprintf(draws->out, ", {line_mm: 60}]}, contact: tube");
}

static void write_vessel(Draws *draws, TortureVessel kind, int model_count, const char *const *model, const double *lumen_mm)
{
    int which;
    switch (kind) {
    case TORTURE_SHAPE:
        which = draw_whole(draws, SHAPES);
        draws->lumen = shape[which].lumen;
        fprintf(draws->out, "vessel: {shape: %s, contact: lim", shape[which].text);
        break;
    case TORTURE_MODEL:
        which = draw_whole(draws, model_count);
        draws->lumen = lumen_mm[which];
        fprintf(draws->out, "vessel: {model: '%s', contact: lim", model[which]);
        break;
    default: write_tube(draws);
    }
    fprintf(draws->out, ", friction: %.4f}\n", draw(draws, 0, 1) < 0.2 ? 0 : draw(draws, 0, 0.3));
}

// --- the tools ---

// A bend that the catheter around it, or the vessel, can hold with a force of 1 N.
static double bend_radius(double radius, double diameter, double inner, double modulus_gpa)
{
    double bending = 1000 * modulus_gpa * 3.141592653589793 / 64 * (pow(diameter, 4) - pow(inner, 4));
    return fmax(radius, sqrt(bending / 2));
}

static void write_tool(Draws *draws, TortureTool tip, double diameter, double inner, double length, int elements, const char *indent)
{
    double modulus = inner > 0 ? draw_log(draws, 0.3, 10) : draw_log(draws, 5, 200), tip_modulus = modulus * draw_log(draws, 0.03, 1);
    double radius = bend_radius(draw(draws, 2.5, 14), diameter, inner, tip_modulus), soft = draw(draws, 10, 40), rest = 0;
    char curve[400] = "";
    switch (tip) {
    case TORTURE_J:
        rest = radius * draw(draws, 0.3, 3);
        snprintf(curve, sizeof curve, "{arc: {radius_mm: %.4f, angle_deg: %.3f, plane_deg: %.2f}}", radius, rest / radius * 180 / 3.141592653589793,
                 draw(draws, -180, 180));
        break;
    case TORTURE_PIGTAIL:
        rest = radius * 4.7;
        snprintf(curve, sizeof curve, "{arc: {radius_mm: %.4f, angle_deg: 269.29, plane_deg: %.2f}}", radius, draw(draws, -180, 180));
        break;
    case TORTURE_SIMMONS: {
        double arm = draw(draws, 5, 25);
        rest = 3 * radius + arm + 0.8 * radius;
        snprintf(curve, sizeof curve,
                 "{arc: {radius_mm: %.4f, angle_deg: 171.887, plane_deg: %.2f}}, {line_mm: %.3f}, {arc: {radius_mm: %.4f, angle_deg: 45.837, plane_deg: 180}}",
                 radius, draw(draws, -180, 180), arm, radius);
        break;
    }
    default: break;
    }
    soft += rest;
    fprintf(draws->out, "%selements: %.0f\n%ssections:\n", indent, elements * draws->finer, indent);
    fprintf(draws->out, "%s  - {length_mm: %.4f, diameter_mm: %.4f, inner_diameter_mm: %.4f, young_modulus_gpa: %.5g, poisson_ratio: 0.3, density_g_cm3: 6}\n",
            indent, fmax(length - soft, 20), diameter, inner, modulus); // a wide stiff tool has a large radius of curvature
    fprintf(draws->out, "%s  - {length_mm: %.4f, diameter_mm: %.4f, inner_diameter_mm: %.4f, young_modulus_gpa: %.5g, poisson_ratio: 0.3, density_g_cm3: 6}\n",
            indent, soft, diameter, inner, tip_modulus);
    if (*curve)
        fprintf(draws->out, "%srest: [%s]\n", indent, curve);
    fprintf(draws->out, "%shand_limit_n: 20\n", indent);
}

static int write_tools(Draws *draws, TortureTool kind)
{
    double widest = fmin(2, 1.6 * draws->lumen), inserted = draw(draws, 0.5, 3);     // the vessel is straight so far
    if (kind != TORTURE_COAXIAL) {
        bool is_tube = kind == TORTURE_SIMMONS || kind == TORTURE_PIGTAIL;
        double diameter = draw_log(draws, 0.2, widest);
        fprintf(draws->out, "wire:\n");
        int elements = 60 + draw_whole(draws, 140);
        double length = draw(draws, 180, 300), inner = is_tube ? diameter * draw(draws, 0.5, 0.85) : 0;
        write_tool(draws, kind, diameter, inner, length, elements, "  ");
        fprintf(draws->out, "sheath: {%s, inserted_mm: %.3f}\n", "inlet: root", inserted);
        return 1;
    }
    static const char *const name[4] = {"a", "b", "c", "d"}, *const tool_kind[4] = {"guide_catheter", "catheter", "microcatheter", "wire"};
    int tools = 2 + draw_whole(draws, 3);
    double outer = draw(draws, 0.5, 1) * widest;
    fprintf(draws->out, "tools:\n");
    for (int k = 0; k < tools; k++) {
        double inner = outer * draw(draws, 0.55, 0.85);
        fprintf(draws->out, "  - name: %s\n    kind: %s\n", name[k], k + 1 < tools ? tool_kind[k] : "wire");
        write_tool(draws, (TortureTool)draw_whole(draws, TORTURE_COAXIAL), outer, k + 1 < tools ? inner : 0, 260 + 95 * k, 50 + 25 * k, "    ");
        outer = inner * draw(draws, 0.6, 0.95);
    }
    fprintf(draws->out, "sheath: {inlet: root, inserted_mm: %.3f}\n", inserted);
    return tools;
}

// --- the hands ---

static double draw_speed(Draws *draws, double most)
{
    static const double share[] = {0, 0.1, 0.3, 1};
    double part = share[draw_whole(draws, 4)];
    return most * part * draw(draws, -0.8, 1);
}

// Each hand keeps a speed for a while; up to 100 mm/s and 1000 degrees a second in both directions.
static void write_script(Draws *draws, int tools, double seconds)
{
    static const char *const name[4] = {"a", "b", "c", "d"};
    fprintf(draws->out, "script:\n");
    for (double t = 0; t < seconds - 1e-3; t += draw(draws, 0.05, 0.5)) {    // the times also differ after rounding in the file
        fprintf(draws->out, "  - {t_s: %.4f", t);
        for (int k = 0; k < tools; k++) {
            double push = draw_speed(draws, 100), twist = draw_speed(draws, 1000);
            if (tools == 1)
                fprintf(draws->out, ", push_mm_s: %.3f, twist_deg_s: %.3f", push, twist);
            else
                fprintf(draws->out, ", %s.push_mm_s: %.3f, %s.twist_deg_s: %.3f", name[k], push, name[k], twist);
        }
        fprintf(draws->out, "}\n");
    }
    fprintf(draws->out, "  - {t_s: %.4f", seconds);
    for (int k = 0; k < tools; k++)
        tools == 1 ? fprintf(draws->out, ", push_mm_s: 0, twist_deg_s: 0") : fprintf(draws->out, ", %s.push_mm_s: 0, %s.twist_deg_s: 0", name[k], name[k]);
    fprintf(draws->out, "}\n");
}

static TortureScene make(uint64_t seed, int64_t steps, int model_count, const char *const *model, const double *lumen_mm, double finer)
{
    static const double step_ms[] = {0.5, 1, 1, 2, 4};
    TortureScene scene = {0};
    size_t length = 0;
    Draws draws = {.random = {seed << 32}, .finer = finer};
    draws.out = open_memstream(&scene.text, &length);
    if (!draws.out)
        return scene;
    scene.vessel = (TortureVessel)draw_whole(&draws, model_count > 0 ? TORTURE_VESSELS : TORTURE_MODEL);
    scene.tool = (TortureTool)draw_whole(&draws, TORTURE_TOOLS);
    scene.step_ms = step_ms[draw_whole(&draws, 5)];
    fprintf(draws.out, "# bench torture, seed %llu: %s in a %s\nseldinger: 1\n", (unsigned long long)seed, torture_tool_name[scene.tool],
            torture_vessel_name[scene.vessel]);
    write_vessel(&draws, scene.vessel, model_count, model, lumen_mm);
    int tools = write_tools(&draws, scene.tool);
    const char *points = draw(&draws, 0, 1) < 0.25 ? ", contact_points: follow" : "";
    fprintf(draws.out, "simulation: {step_ms: %g%s}\n", scene.step_ms / finer, points);
    write_script(&draws, tools, (double)steps * scene.step_ms / 1000);
    bool good = !ferror(draws.out);
    if (fclose(draws.out) != 0 || !good) {
        free(scene.text);
        scene.text = NULL;
    }
    return scene;
}

TortureScene torture_scene(uint64_t seed, int64_t steps, int model_count, const char *const *model, const double *lumen_mm)
{
    return make(seed, steps, model_count, model, lumen_mm, 1);
}

char *torture_scene_finer(uint64_t seed, int64_t steps, int model_count, const char *const *model, const double *lumen_mm)
{
    return make(seed, steps, model_count, model, lumen_mm, 2).text;
}
