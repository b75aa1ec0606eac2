// seldinger query: evaluates field, gradient and Taubin distance of a model at points (CSV in, CSV out).
#include "cli/cli.h"

#include "base/base.h"
#include "cli/output_plan.h"
#include "cli/point_table.h"
#include "recon/recon.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

typedef struct QueryOptions {
    const char *file, *points, *output;
    int model, threads;      // model: index in model_names; -1: the first that the file has
    bool quiet;
} QueryOptions;

static const Option options[] = {
    {"points", "F.csv", OPTION_FILE, OPTION_AT(QueryOptions, points),
     "CSV with columns x_mm,y_mm,z_mm in any order (others are ignored), one point per line; # begins a comment; at most 1 GB"},
    {"output", "F.csv", OPTION_FILE, OPTION_AT(QueryOptions, output), "x_mm,y_mm,z_mm,node,f,gx,gy,gz,distance_mm,inside; - is standard output", .letter = 'o'},
    CLI_MODEL(QueryOptions, model, "the model that is evaluated"),
    CLI_THREADS(QueryOptions, threads),
    CLI_QUIET(QueryOptions, quiet, "no summary"),
};

static void set_defaults(void *structure) { *(QueryOptions *)structure = (QueryOptions){.model = -1}; }

static const char *check(void *structure)
{
    const QueryOptions *query = structure;
    return !query->points ? "missing --points F.csv" : !query->output ? "missing -o F.csv" : NULL;
}

// --- results ---

typedef struct Text {
    char *bytes;
    size_t length, capacity;
    bool failed;
} Text;

__attribute__((format(printf, 2, 3))) static void print_to(Text *text, const char *format, ...)
{
    if (text->capacity - text->length < 512) {
        size_t capacity = 2 * text->capacity + 65536;
        char *more = realloc(text->bytes, capacity);
        if (!more) {
            text->failed = true;
            return;
        }
        text->bytes = more;
        text->capacity = capacity;
    }
    va_list arguments;
    va_start(arguments, format);
    text->length += (size_t)vsnprintf(text->bytes + text->length, text->capacity - text->length, format, arguments);
    va_end(arguments);
}

typedef struct Answers {
    const ModelField *model;
    const PointTable *table;
    int *node;               // (table->count)
    double *f;
    Vec3 *gradient;
} Answers;

enum { CHUNK = 256 };        // points per job

static void answer_chunk(void *context, long chunk)
{
    const Answers *a = context;
    for (int i = (int)chunk * CHUNK; i < a->table->count && i < ((int)chunk + 1) * CHUNK; i++) {
        int node = power_nearest(a->model->tree, a->table->point[i]);
        a->f[i] = model_field_at(a->model, node, a->table->point[i], &a->gradient[i]);
        a->node[i] = model_field_file_node(a->model, node);
    }
}

static bool answer(const ModelField *model, const PointTable *table, int threads, const char *output, Faults *faults)
{
    size_t count = (size_t)table->count + 1;
    Answers a = {model, table, malloc(count * sizeof *a.node), malloc(count * sizeof *a.f), malloc(count * sizeof *a.gradient)};
    Text text = {.failed = !a.node || !a.f || !a.gradient};
    if (!text.failed) {
        parallel_for(threads, (table->count + CHUNK - 1) / CHUNK, answer_chunk, &a, NULL);
        print_to(&text, "x_mm,y_mm,z_mm,node,f,gx,gy,gz,distance_mm,inside\n");
    }
    for (int i = 0; i < table->count && !text.failed; i++) {
        Vec3 x = table->point[i], g = a.gradient[i];
        double f = a.f[i], slope = vec3_norm(g);
        double distance = slope > 0 ? f / slope : f > 0 ? HUGE_VAL : -HUGE_VAL;   // at a maximum of the field, or beyond its support
        print_to(&text, "%.17g,%.17g,%.17g,%d,%.17g,%.17g,%.17g,%.17g,%.17g,%d\n", x.x, x.y, x.z, a.node[i], f, g.x, g.y, g.z, distance, f > 0);
    }
    free(a.node);
    free(a.f);
    free(a.gradient);
    bool good = !text.failed && output_write(output, text.bytes, text.length, faults);
    if (text.failed)
        faults_add(faults, output, 0, 0, "out of memory for %d points", table->count);
    free(text.bytes);
    return good;
}

static int query(void *structure, Faults *faults)
{
    const QueryOptions *query = structure;
    PointTable table = {0};
    OutputPlan plan = {.faults = faults};
    output_plan_write(&plan, "-o", query->output);
    output_plan_read(&plan, "the model", query->file);
    output_plan_read(&plan, "--points", query->points);
    ModelFile file;
    model_file_load_model(query->file, query->model, &file, faults);
    point_table_read(query->points, &table, faults);
    bool good = faults->count == 0 && answer(&file.field, &table, query->threads, query->output, faults);
    if (good && !query->quiet && strcmp(query->output, "-"))
        printf("%d points\n", table.count);
    model_file_free(&file);
    free(table.point);
    return EXIT_DONE;
}

static const OptionTable table = {
    .program = "seldinger query",
    .does = "field, gradient and distance of a model at points",
    .usage = "MODEL.h5 --points F.csv -o F.csv",
    .intro = "Evaluates a fitted model at points: the node by power distance over the whole tree, field f (> 0 inside), its gradient, and the signed Taubin "
             "distance f / |grad f| (> 0 inside). Of a swept model f is the blended field in mm, and the node is the tree's that is nearest along the branch.",
    .exits = CLI_BAD_INPUT_EXITS,
    CLI_OPTIONS(options, QueryOptions),
    .set_defaults = set_defaults,
    .check = check,
    .takes_argument = true,
    .argument = offsetof(QueryOptions, file),
    .missing = "missing the model",
    .too_many = "one model at a time, not also ",
};

const Verb query_verb = {.options = &table, .call = query};
