// seldinger bench step --tools: the cost of a step of coaxial tools, by number of tools and nodes.
//
// Four tools of the device library in the phantom, the arch and the angiogram. With three tools the intermediate catheter is left out, with two also the guide,
// with one also the microcatheter. Nodes are spread evenly from the outermost hub to the depth of the wire, and tool j of K reaches (j + 1) / K of it:
// each layer has the same share. First all hands push until the tips are there, each at its own speed; then the tools slide and rotate against each other;
// then they rest.
#include "bench/tools.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *const vessel_name[TOOLS_VESSELS] = {"phantom", "arch", "angiogram"};
static const struct {
    const char *path, *needs;            // `needs`: without this file the row is skipped
    double depth_mm, speed_mm_s;         // of the wire
} stack[TOOLS_VESSELS] = {{"scenes/coaxial/siphon.yaml", NULL, 90, 20},
                          {"scenes/coaxial/arch.yaml", "scenes/arch/arch.h5", 300, 48},
                          {"scenes/coaxial/angiogram.yaml", "scenes/aneurism/aneurism.h5", 100, 20}};
static const int tools_bench_nodes[TOOLS_NODES] = {50, 100, 200, 400};
static const double margin_mm = 15, hub_mm = 25;     // length of the outermost tool that stays in the sheath; distance between successive hubs
// Limits for the cost by number of tools and nodes: median and p99.9.
static const double must_us[2] = {300, 1000};
enum { MUST_TOOLS = 3, MUST_NODES = 200, SECTIONS_MOST = 64 };

// Keeps the distal `length` of a tool. `section` has room for all its sections.
static void cut(WireOptions *wire, double length, WireSection *section)
{
    int first = wire->section_count;
    double total = 0;
    while (first > 0 && total < length)
        total += wire->section[--first].length;
    int count = wire->section_count - first;
    memcpy(section, wire->section + first, (size_t)count * sizeof *section);
    section[0].length -= fmax(0, total - length);
    wire->section = section;
    wire->section_count = count;
}

// The scene with `tools` of its four tools. `section`: room for their sections.
static Scene with_tools(const Scene *scene, int tools, int nodes, double depth, WireSection *section)
{
    static const int kept[4][4] = {{3}, {2, 3}, {0, 2, 3}, {0, 1, 2, 3}};
    Scene s = *scene;
    s.tool_count = tools;
    double spacing = (depth + margin_mm) / nodes, inserted = scene->wire.inserted;
    for (int k = 0; k < tools; k++) {
        s.tool[k] = scene->tool[kept[tools - 1][k]];
        WireOptions *wire = &s.tool[k].wire;
        cut(wire, depth * (k + 1) / tools + margin_mm + k * hub_mm, section + k * SECTIONS_MOST);
        wire->inserted = inserted;
        wire->elements = (int)ceil(wire_length(wire) / spacing);
    }
    WireOptions place = scene->wire;
    s.wire = s.tool[0].wire;
    s.wire.start = place.start, s.wire.direction = place.direction, s.wire.normal = place.normal;
    s.wire.has_sheath = place.has_sheath, s.wire.gravity = place.gravity;
    return s;
}

static ToolCommands commands_at(int tools, double t_s, double feed_s, double speed)
{
    ToolCommands c = {0};
    // push and twist of each hand, as fractions of the speed and of 90 degrees a second; each row lasts half a second
    static const double play[6][4][2] = {{{0, 0}, {-0.5, 0.5}, {0.5, 1}, {-0.5, 1}}, {{0.2, 0}, {0.5, 0.5}, {-0.5, 0}, {0.5, 0}},
                                         {{0, 0.3}, {0, 0}, {0.5, -1}, {0.5, -1}},   {{-0.2, 0}, {0, -0.5}, {-0.5, 0}, {-0.5, 0}},
                                         {{0, -0.3}, {0, 0}, {0, 0}, {0, 0}},        {{0, 0}, {0, -0.5}, {0, 0}, {0, 0}}};
    int part = (int)floor((t_s - feed_s) / 0.5 + 1e-9);
    for (int k = 0; k < tools; k++) {
        if (t_s < feed_s)
            c.tool[k].push_mm_s = speed * (k + 1) / tools;
        else if (part < 6)
            c.tool[k] = (Command){speed * play[part][4 - tools + k][0], 90 * play[part][4 - tools + k][1]};
    }
    return c;
}

static bool run(const Scene *scene, const Vessel *vessel, double depth, double speed, bool quick, ToolsRow *row, Faults *faults)
{
    Simulator *simulator = simulator_create(scene, vessel, faults);
    if (!simulator)
        return false;
    double feed_s = (depth - scene->wire.inserted) / speed, end_s = feed_s + 3.5;
    int64_t steps = quick ? 200 : (int64_t)(end_s * 1000 / scene->dt), begin = bench_cpu_ns();
    for (int64_t i = 0; i < steps && !(simulator_last(simulator)->flags & STEP_DIVERGED); i++) {
        ToolCommands commands = commands_at(scene->tool_count, (double)i * scene->dt / 1000, feed_s, speed);
        simulator_step(simulator, &commands);
        for (int k = 0; k < scene->tool_count; k++)
            row->push_most = fmax(row->push_most, fabs(simulator_last(simulator)->push[k]));
    }
    row->tools = scene->tool_count;
    row->chain_nodes = simulator_state(simulator)->node_count;
    bench_figures(simulator, (double)(bench_cpu_ns() - begin) * 1e-9, &row->run);
    simulator_destroy(simulator);
    return true;
}

bool bench_tools(const BenchOptions *options, ToolsBench *bench, Faults *faults)
{
    for (int v = 0; v < TOOLS_VESSELS; v++) {
        bench->present[v] = !stack[v].needs || access(stack[v].needs, R_OK) == 0;
        if (!bench->present[v])
            continue;
        BenchScene s;
        bool good = bench_open(stack[v].path, options->threads, &s, faults);
        WireSection *section = good ? calloc(TOOLS_MOST * SECTIONS_MOST, sizeof *section) : NULL;
        good &= section != NULL;
        for (int n = 0; good && n < TOOLS_NODES; n++)
            for (int k = 0; good && k < TOOLS_MOST; k++) {
                Scene scene = with_tools(s.scene, k + 1, tools_bench_nodes[n], stack[v].depth_mm, section);
                good = run(&scene, s.open.vessel, stack[v].depth_mm, stack[v].speed_mm_s, options->quick, &bench->row[v][n][k], faults);
            }
        free(section);
        bench_close(&s);
        if (!good)
            return false;
    }
    return true;
}

void bench_tools_print(FILE *out, const ToolsBench *bench)
{
    for (int v = 0; v < TOOLS_VESSELS; v++) {
        if (!bench->present[v]) {
            fprintf(out, "\n%s: skipped, %s is not here\n", vessel_name[v], stack[v].needs);
            continue;
        }
        fprintf(
            out,
            "\n%s, coaxial tools: %g mm at %g mm/s, then against each other\n"
            "    tools nodes  CPU [us] median     p99   p99.9     max  assemble contact  iterations, p99.9  deepest [um]  push [N]  not converged, limited\n",
            vessel_name[v], stack[v].depth_mm, stack[v].speed_mm_s);
        for (int k = 0; k < TOOLS_MOST; k++)
            for (int n = 0; n < TOOLS_NODES; n++) {
                const ToolsRow *r = &bench->row[v][n][k];
                const StepFigures *f = &r->run;
                bool has_must = r->tools == MUST_TOOLS && tools_bench_nodes[n] == MUST_NODES,
                     holds = f->step_us.median <= must_us[0] && f->step_us.p999 <= must_us[1];
                fprintf(out, "    %5d %5d %16.0f %7.0f %7.0f %7.0f %9.0f %7.0f %10.0f %7.0f %13.1f %9.3f %8" PRId64 " %5" PRId64 "%s%s\n", r->tools,
                        r->chain_nodes, f->step_us.median, f->step_us.p99, f->step_us.p999, f->step_us.max, f->stage_us[STAGE_ASSEMBLE].median,
                        f->stage_us[STAGE_CONTACT].median, f->iterations.median, f->iterations.p999, f->penetration_um.max, r->push_most, f->not_converged,
                        f->limited, f->flags & STEP_DIVERGED ? "  DIVERGED" : "",
                        !has_must ? ""
                        : holds   ? "  must"
                                  : "  MISSED");
            }
    }
}

void bench_tools_json(cJSON *list, const ToolsBench *bench)
{
    for (int v = 0; v < TOOLS_VESSELS; v++)
        for (int k = 0; bench->present[v] && k < TOOLS_MOST; k++)
            for (int n = 0; n < TOOLS_NODES; n++) {
                const ToolsRow *r = &bench->row[v][n][k];
                cJSON *at = bench_figures_json(&r->run);
                cJSON_AddItemToArray(list, at);
                cJSON_AddStringToObject(at, "vessel", vessel_name[v]);
                cJSON_AddNumberToObject(at, "tools", r->tools);
                cJSON_AddNumberToObject(at, "nodes", r->chain_nodes);
                cJSON_AddNumberToObject(at, "push_most_n", r->push_most);
            }
}
