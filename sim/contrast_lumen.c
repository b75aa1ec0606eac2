#include "sim/contrast_lumen.h"

#include "base/base.h"

#include <stdlib.h>
#include <string.h>

enum { SLUGS = 16 };
static const double NOTHING = 1e-9;          // [mm3] of agent below which a lumen counts as clear

// A piece of the column, ordered from the hub to the tip.
typedef struct Slug {
    double volume, concentration;
} Slug;

typedef struct Column {
    int count;
    Slug slug[SLUGS + 2];                    // two more for inflow, until neighbours are merged
} Column;

typedef struct Bore {                        // of one tool, by its sections
    int section_count;
    double *end, *outer, *lumen;             // [mm] arc length at its end; radii
    double length;
    bool is_open;                            // has a lumen over its whole length
    int node_count;
    double *s;
} Bore;

typedef struct Piece {                       // a stretch of lumen of constant section
    double end;
    double area, resistance;                 // area open for flow [mm2]; [1/mm3], pressure over flow and viscosity
} Piece;

struct ContrastLumens {
    LumenOptions options;
    int tool_count, piece_count;
    Bore device[TOOLS_MOST][1 + EXCHANGES_MOST];     // of each device that may be this tool …
    Bore bore[TOOLS_MOST];                   // … of the device inserted now, whose arrays these are
    int capacity[TOOLS_MOST];                // node count of the device with most nodes
    int fitted[TOOLS_MOST];
    Column column[TOOLS_MOST];
    Piece *piece;                            // pieces of the current lumen
};

LumenOptions lumen_default_options(void) { return (LumenOptions){.pressure_mpa = 2.07, .viscosity_mpa_s = 6.3e-9, .flush_ml_s = 0.05}; }

double lumen_annulus_share(double ratio)
{
    const double narrow = 1e-3;              // below it the formula suffers from cancellation, and the flow between flat walls is accurate to 1e-6
    if (!(ratio > 0))
        return 1;
    if (ratio >= 1)
        return 0;
    double gap = 1 - ratio, open = 1 - ratio * ratio;
    return gap < narrow ? 4.0 / 3 * gap * gap * gap * (1 - gap / 2) : 1 - ratio * ratio * ratio * ratio - open * open / -same_log(ratio);
}

// --- the tools ---

static bool make_bore(Bore *bore, const WireOptions *wire, int node_count, const double *s)
{
    size_t count = (size_t)wire->section_count;
    *bore = (Bore){.section_count = wire->section_count,
                   .is_open = count > 0,
                   .node_count = node_count,
                   .end = calloc(3 * count + 1, sizeof *bore->end),
                   .s = calloc((size_t)node_count + 1, sizeof *bore->s)};
    if (!bore->end || !bore->s)
        return false;
    bore->outer = bore->end + count;
    bore->lumen = bore->outer + count;
    for (size_t i = 0; i < count; i++) {
        bore->length += wire->section[i].length;
        bore->end[i] = bore->length;
        bore->outer[i] = wire->section[i].diameter / 2;
        bore->lumen[i] = wire->section[i].inner_diameter > 0 ? wire->section[i].inner_diameter / 2 : 0;
        bore->is_open = bore->is_open && bore->lumen[i] > 0;
    }
    memcpy(bore->s, s, (size_t)node_count * sizeof *s);
    return true;
}

static bool make_spare(ContrastLumens *lumens, const Scene *scene, int tool, int which)
{
    char why[256];
    Wire nodes;
    WireOptions wire = scene_device_wire(scene, tool, which);
    if (!wire_create(&nodes, &wire, why, (int)sizeof why))
        return false;
    bool good = make_bore(&lumens->device[tool][which], &wire, nodes.node_count, nodes.s);
    lumens->capacity[tool] = nodes.node_count > lumens->capacity[tool] ? nodes.node_count : lumens->capacity[tool];
    wire_destroy(&nodes);
    return good;
}

ContrastLumens *contrast_lumens_create(const Scene *scene, const int *node_count, const double *const *s, const LumenOptions *options)
{
    ContrastLumens *lumens = calloc(1, sizeof *lumens);
    bool good = lumens != NULL;
    size_t borders = 0;
    if (good)
        lumens->options = options ? *options : lumen_default_options();
    for (int k = 0; good && k < scene->tool_count; k++) {
        WireOptions wire = scene_tool_wire(scene, k);
        lumens->tool_count = k + 1;
        lumens->capacity[k] = node_count[k];
        good = make_bore(&lumens->device[k][0], &wire, node_count[k], s[k]);
        size_t most = (size_t)wire.section_count;
        for (int i = 1; good && i < scene_device_count(scene, k); i++) {
            good = make_spare(lumens, scene, k, i);
            most = (size_t)lumens->device[k][i].section_count > most ? (size_t)lumens->device[k][i].section_count : most;
        }
        lumens->bore[k] = lumens->device[k][0];
        borders += most + 2;                 // its sections' ends, tip and proximal end
    }
    if (good && (lumens->piece = calloc(borders + 1, sizeof *lumens->piece)))
        return lumens;
    contrast_lumens_free(lumens);
    return NULL;
}

void contrast_lumens_free(ContrastLumens *lumens)
{
    if (!lumens)
        return;
    for (int k = 0; k < lumens->tool_count; k++)
        for (int i = 0; i <= EXCHANGES_MOST; i++) {
            free(lumens->device[k][i].end);
            free(lumens->device[k][i].s);
        }
    free(lumens->piece);
    free(lumens);
}

void contrast_lumens_copy(ContrastLumens *to, const ContrastLumens *from)
{
    memcpy(to->column, from->column, sizeof to->column);
    for (int k = 0; k < to->tool_count; k++) {
        to->fitted[k] = from->fitted[k];
        to->bore[k] = to->device[k][to->fitted[k]];
    }
}

double contrast_lumens_fit(ContrastLumens *lumens, int tool, int which)
{
    if (which == lumens->fitted[tool] || which < 0 || which > EXCHANGES_MOST || lumens->device[tool][which].section_count == 0)
        return 0;
    double gone = contrast_lumens_within(lumens, tool);
    lumens->fitted[tool] = which;
    lumens->bore[tool] = lumens->device[tool][which];
    lumens->column[tool].count = 0;
    return gone;
}

int contrast_lumens_tool(const ContrastLumens *lumens, int tool)
{
    while (tool >= 0 && !(tool < lumens->tool_count && lumens->bore[tool].is_open))
        tool--;
    return tool;
}

static int section_at(const Bore *bore, double s)
{
    int i = 0;
    while (i + 1 < bore->section_count && bore->end[i] <= s)
        i++;
    return i;
}

// The tool within `tool` at its arc length s, -1: none; `*border` is reduced if the tool within changes before it.
static int occupant(const ContrastLumens *lumens, int tool, const double *inserted, double s, double *border, double *radius)
{
    const double same = 1e-9;
    double x = s + inserted[tool] - lumens->bore[tool].length;   // distance from the mouth
    int found = -1;
    *radius = 0;
    for (int j = tool + 1; j < lumens->tool_count; j++) {
        const Bore *inner = &lumens->bore[j];
        double tip = inserted[j] - x, hub = tip - inner->length;     // how far ahead of s
        if (hub > same)
            *border = fmin(*border, s + hub);
        if (hub > same || tip <= same)
            continue;
        *border = fmin(*border, s + tip);
        if (found >= 0)
            continue;
        found = j;
        int i = section_at(inner, same - hub);
        *radius = inner->outer[i];
        if (i + 1 < inner->section_count)
            *border = fmin(*border, s + hub + inner->end[i]);
    }
    return found;
}

// Divides the lumen of `tool`, from the hub, into lumens->piece.
static void cut_lumen(ContrastLumens *lumens, int tool, const double *inserted)
{
    const Bore *bore = &lumens->bore[tool];
    lumens->piece_count = 0;
    for (double s = 0; s < bore->length;) {
        int own = section_at(bore, s);
        double end = bore->end[own], radius, r = bore->lumen[own];
        occupant(lumens, tool, inserted, s, &end, &radius);
        double share = r > 0 ? lumen_annulus_share(radius / r) : 0;
        lumens->piece[lumens->piece_count++] =
            (Piece){end, PI * fmax(r * r - radius * radius, 0), share > 0 ? 8 * (end - s) / (PI * r * r * r * r * share) : HUGE_VAL};
        s = end;
    }
}

static double volume_of(const ContrastLumens *lumens)
{
    double volume = 0, from = 0;
    for (int i = 0; i < lumens->piece_count; i++) {
        volume += lumens->piece[i].area * (lumens->piece[i].end - from);
        from = lumens->piece[i].end;
    }
    return volume;
}

double contrast_lumens_passes(ContrastLumens *lumens, int tool, const double *inserted)
{
    double resistance = 0;
    if (!lumens->bore[tool].is_open)
        return 0;
    cut_lumen(lumens, tool, inserted);
    for (int i = 0; i < lumens->piece_count; i++)
        resistance += lumens->piece[i].resistance;
    return lumens->options.pressure_mpa / (resistance * lumens->options.viscosity_mpa_s) / 1000;
}

// --- a column ---

double contrast_lumens_within(const ContrastLumens *lumens, int tool)
{
    double sum = 0;
    for (int i = 0; i < lumens->column[tool].count; i++)
        sum += lumens->column[tool].slug[i].volume * lumens->column[tool].slug[i].concentration;
    return sum;
}

static void remove_slug(Column *column, int at)
{
    column->count--;
    memmove(&column->slug[at], &column->slug[at + 1], (size_t)(column->count - at) * sizeof column->slug[0]);
}

// Merges two neighbouring pieces, conserving their agent.
static void mix(Column *column, int at)
{
    Slug *a = &column->slug[at], *b = a + 1;
    double volume = a->volume + b->volume;
    if (volume > 0)
        a->concentration = (a->volume * a->concentration + b->volume * b->concentration) / volume;
    a->volume = volume;
    remove_slug(column, at + 1);
}

// If there are too many pieces, the two smallest neighbours are merged.
static void limit(Column *column)
{
    while (column->count > SLUGS) {
        int least = 0;
        for (int i = 1; i + 1 < column->count; i++)
            if (column->slug[i].volume + column->slug[i + 1].volume < column->slug[least].volume + column->slug[least + 1].volume)
                least = i;
        mix(column, least);
    }
}

static void enter_at_hub(Column *column, double volume, double concentration)
{
    if (!(volume > 0))
        return;
    memmove(&column->slug[1], &column->slug[0], (size_t)column->count * sizeof column->slug[0]);
    column->slug[0] = (Slug){volume, concentration};
    column->count++;
    if (column->count > 1 && fabs(column->slug[1].concentration - concentration) < 1e-12)
        mix(column, 0);
    limit(column);
}

static void enter_at_tip(Column *column, double volume)
{
    if (!(volume > 0))
        return;
    column->slug[column->count++] = (Slug){volume, 0};
    if (column->count > 1 && column->slug[column->count - 2].concentration <= 0)
        mix(column, column->count - 2);
    limit(column);
}

static double leave_at_tip(Column *column, double volume)
{
    double agent = 0;
    while (volume > 0 && column->count > 0) {
        Slug *last = &column->slug[column->count - 1];
        double part = fmin(volume, last->volume);
        agent += part * last->concentration;
        volume -= part;
        last->volume -= part;
        if (last->volume <= 0)
            column->count--;
    }
    return agent;
}

static double column_volume(const Column *column)
{
    double sum = 0;
    for (int i = 0; i < column->count; i++)
        sum += column->slug[i].volume;
    return sum;
}

// Adjusts the column to the lumen's present volume: surplus leaves and missing volume enters at the tip.
static double fit(ContrastLumens *lumens, Column *column)
{
    double more = volume_of(lumens) - column_volume(column);
    enter_at_tip(column, more);
    return leave_at_tip(column, -more);
}

void contrast_lumens_advance(ContrastLumens *lumens, double dt_s, const double *inserted, int tool, double volume, double *out)
{
    for (int k = 0; k < lumens->tool_count; k++) {
        Column *column = &lumens->column[k];
        bool is_injected = k == tool && volume > 0;
        if (!lumens->bore[k].is_open || (column->count == 0 && !is_injected))
            continue;
        double saline = is_injected ? 0 : 1000 * fmin(lumens->options.flush_ml_s, contrast_lumens_passes(lumens, k, inserted)) * dt_s;
        if (is_injected)
            cut_lumen(lumens, k, inserted);
        enter_at_hub(column, is_injected ? volume : saline, is_injected);
        out[k] += fit(lumens, column);
        double within = contrast_lumens_within(lumens, k);
        if (within < NOTHING && !is_injected) {
            out[k] += within;
            column->count = 0;
        }
    }
}

// --- concentrations ---

// Agent in the first `volume` from the hub.
static double agent_within(const Column *column, double volume)
{
    double agent = 0;
    for (int i = 0; i < column->count && volume > 0; i++) {
        agent += fmin(volume, column->slug[i].volume) * column->slug[i].concentration;
        volume -= column->slug[i].volume;
    }
    return agent;
}

// Volume of the lumen, after cut_lumen(), from the hub to the arc length s.
static double volume_to(const ContrastLumens *lumens, double s)
{
    double volume = 0, from = 0;
    for (int i = 0; i < lumens->piece_count && from < s; i++) {
        volume += lumens->piece[i].area * (fmin(lumens->piece[i].end, s) - from);
        from = lumens->piece[i].end;
    }
    return volume;
}

double contrast_lumens_front(ContrastLumens *lumens, int tool, const double *inserted)
{
    const Column *column = &lumens->column[tool];
    double volume = 0, reach = 0, from = 0;
    for (int i = 0; i < column->count; i++) {
        volume += column->slug[i].volume;
        if (column->slug[i].concentration > 0)
            reach = volume;
    }
    if (!(reach > 0))
        return 0;
    cut_lumen(lumens, tool, inserted);
    for (int i = 0; i < lumens->piece_count; i++) {
        double piece = lumens->piece[i].area * (lumens->piece[i].end - from);
        if (piece > reach)
            return from + reach / lumens->piece[i].area;
        reach -= piece;
        from = lumens->piece[i].end;
    }
    return from;
}

int contrast_lumens_node_count(const ContrastLumens *lumens)
{
    int count = 0;
    for (int k = 0; k < lumens->tool_count; k++)
        count += lumens->capacity[k];
    return count;
}

// Volume of the whole lumen, including the inner tool.
static double bore_volume_to(const Bore *bore, double s)
{
    double volume = 0, from = 0;
    for (int i = 0; i < bore->section_count && from < s; i++) {
        volume += PI * bore->lumen[i] * bore->lumen[i] * (fmin(bore->end[i], s) - from);
        from = bore->end[i];
    }
    return volume;
}

static void read_tool(ContrastLumens *lumens, int tool, const double *inserted, float *filling)
{
    const Bore *bore = &lumens->bore[tool];
    const Column *column = &lumens->column[tool];
    if (column->count > 0)
        cut_lumen(lumens, tool, inserted);
    double agent = 0, whole = 0;
    for (int j = 0; j < bore->node_count; j++) {
        filling[j] = 0;
        if (column->count == 0)
            continue;
        double end = j + 1 < bore->node_count ? (bore->s[j] + bore->s[j + 1]) / 2 : bore->length;
        double agent_to = agent_within(column, volume_to(lumens, end)), whole_to = bore_volume_to(bore, end);
        if (whole_to > whole)
            filling[j] = (float)fmin((agent_to - agent) / (whole_to - whole), 1);
        agent = agent_to;
        whole = whole_to;
    }
}

void contrast_lumens_read(ContrastLumens *lumens, const double *inserted, float *filling)
{
    for (int k = 0; k < lumens->tool_count; k++) {
        read_tool(lumens, k, inserted, filling);
        for (int j = lumens->bore[k].node_count; j < lumens->capacity[k]; j++)
            filling[j] = 0;
        filling += lumens->capacity[k];
    }
}
