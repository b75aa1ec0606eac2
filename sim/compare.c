#include "sim/compare.h"

#include "base/base.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char header[] = "t_s,node,x_mm,y_mm,z_mm", tools_header[] = "t_s,tool,node,x_mm,y_mm,z_mm";
static const double sample_s = 0.05;
enum { SAMPLED_NODES = 21 };

double golden_comment(const char *text, size_t length, const char *name, double missing)
{
    char key[64];
    int key_length = snprintf(key, sizeof key, "# %s:", name);
    for (const char *line = text, *end = text + length; line < end;) {
        const char *stop = memchr(line, '\n', (size_t)(end - line));
        if (!stop)
            stop = end;
        if (stop - line > key_length && !memcmp(line, key, (size_t)key_length)) {
            const char *from = line + key_length, *to = stop;
            while (from < to && *from == ' ')
                from++;
            while (to > from && (to[-1] == '\r' || to[-1] == ' '))
                to--;
            double value;
            if (number_of_text(from, (size_t)(to - from), &value))
                return value;
        }
        line = stop + 1;
    }
    return missing;
}

// The name of the comment with a tool's node count.
static const char *nodes_key(const ToolPath *path, int tool, char text[40])
{
    if (path->tool_count == 1)
        return "nodes";
    snprintf(text, 40, "nodes of tool %d", tool);
    return text;
}

// Reads the number of tools and the node count of each.
static void parse_counts(const char *text, size_t length, const char *file, ToolPath *path, Faults *faults)
{
    double tools = golden_comment(text, length, "tools", 1);
    char key[40];
    if (tools < 1 || tools > STEP_TOOLS_MAX || tools != floor(tools)) {
        faults_add(faults, file, 1, 1, "has the comment '# tools: %g'; expected 1 to %d", tools, STEP_TOOLS_MAX);
        return;
    }
    path->tool_count = (int)tools;
    for (int k = 0; k < path->tool_count; k++) {
        const char *name = nodes_key(path, k, key);
        double nodes = golden_comment(text, length, name, -1);
        if (nodes < 2 || nodes > 1e6 || nodes != floor(nodes))
            faults_add(faults, file, 1, 1, "has no comment '# %s: N' with the tool's number of nodes; make the file with `seldinger check --update`", name);
        else
            path->node_count[k] = (int)nodes;
    }
}

#define FARTHEST_MM 1e9

static bool is_whole(double value, int most) { return value >= 0 && value <= most && value == floor(value); }

// Rows are sorted by time, tool and node; times are printed with six digits.
static double time_slack(double t_s) { return 1e-5 * fmax(1, fabs(t_s)); }

static bool comes_before(const PathRow *row, const PathRow *reference, double slack)
{
    bool same_time = fabs(row->t_s - reference->t_s) <= slack;
    return row->t_s < reference->t_s - slack || (same_time && (row->tool < reference->tool || (row->tool == reference->tool && row->node < reference->node)));
}

static void parse_rows(const NumberTable *table, const char *file, ToolPath *path, Faults *faults)
{
    bool several = path->tool_count > 1;
    int before = faults->count;
    path->row_count = path->row_capacity = table->row_count;
    for (int i = 0; i < table->row_count; i++) {
        const double *value = table->value + (size_t)i * (size_t)table->column_count, *place = value + (several ? 2 : 1);
        double tool = several ? value[1] : 0;
        if (!is_whole(tool, path->tool_count - 1))
            faults_add(faults, file, table->line[i], 1, "tool is %g; expected a whole number from 0 to %d", tool, path->tool_count - 1);
        else if (!is_whole(place[0], INT_MAX))
            faults_add(faults, file, table->line[i], 1, "node is %g; expected a whole number of at least 0", place[0]);
        else if (fabs(place[1]) > FARTHEST_MM || fabs(place[2]) > FARTHEST_MM || fabs(place[3]) > FARTHEST_MM)
            faults_add(faults, file, table->line[i], 1, "a coordinate is beyond +-%g mm", FARTHEST_MM);
        else
            path->row[i] = (PathRow){value[0], (int)tool, (int)place[0], vec3(place[1], place[2], place[3])};
        if (faults->count == before && i > 0 && !comes_before(&path->row[i - 1], &path->row[i], time_slack(value[0])))
            faults_add(faults, file, table->line[i], 1, "the row is out of order; expected rows sorted by time, tool and node, each once");
    }
    if (table->row_count == 0)
        faults_add(faults, file, 0, 0, "has no row; make the file with `seldinger check --update`");
}

ToolPath *tool_path_parse(const char *text, size_t length, const char *file, Faults *faults)
{
    int before = faults->count;
    ToolPath *path = calloc(1, sizeof *path);
    if (path)
        parse_counts(text, length, file, path, faults);
    NumberTable *table = path && path->tool_count > 0 ? number_table_parse(text, length, file, path->tool_count > 1 ? tools_header : header, faults) : NULL;
    if (table)
        path->row = calloc((size_t)table->row_count + 1, sizeof *path->row);
    if (!path || (table && !path->row))
        faults_add(faults, file, 0, 0, "not enough memory for its rows");
    if (table && path->row) {
        path->duration_s = golden_comment(text, length, "duration_s", -1);
        if (path->duration_s < 0 || path->duration_s > SCRIPT_LONGEST_S)
            faults_add(faults, file, 1, 1, "has no comment '# duration_s: S'; make the file with `seldinger check --update`");
        parse_rows(table, file, path, faults);
    }
    number_table_free(table);
    if (faults->count > before) {
        tool_path_free(path);
        return NULL;
    }
    return path;
}

// + 0.0 turns a minus zero, which rounding can leave, into zero.
static double rounded(double value) { return round(value * 1e7) / 1e7 + 0.0; }

char *tool_path_print(const ToolPath *path, size_t *length)
{
    char *text = NULL, key[40];
    bool several = path->tool_count > 1;
    FILE *stream = open_memstream(&text, length);
    if (!stream)
        return NULL;
    fprintf(stream, "# seldinger golden tool path; made by `seldinger check --update`\n");
    if (several)
        fprintf(stream, "# tools: %d\n", path->tool_count);
    for (int k = 0; k < path->tool_count; k++)
        fprintf(stream, "# %s: %d\n", nodes_key(path, k, key), path->node_count[k]);
    fprintf(stream, "# duration_s: %.9g\n%s\n", path->duration_s, several ? tools_header : header);
    for (int i = 0; i < path->row_count; i++) {
        const PathRow *row = &path->row[i];
        fprintf(stream, "%.6g,", row->t_s);
        if (several)
            fprintf(stream, "%d,", row->tool);
        fprintf(stream, "%d,%.7f,%.7f,%.7f\n", row->node, rounded(row->position.x), rounded(row->position.y), rounded(row->position.z));
    }
    if (fclose(stream) != 0) {
        free(text);
        return NULL;
    }
    return text;
}

void tool_path_free(ToolPath *path)
{
    if (!path)
        return;
    free(path->row);
    free(path->node);
    free(path);
}

char *golden_path_of(const char *scene_path)
{
    static const char ending[] = ".golden.csv";
    size_t stem = strlen(scene_path);
    if (stem > 5 && !strcmp(scene_path + stem - 5, ".yaml"))
        stem -= 5;
    else if (stem > 4 && !strcmp(scene_path + stem - 4, ".yml"))
        stem -= 4;
    char *path = malloc(stem + sizeof ending);
    if (path) {
        memcpy(path, scene_path, stem);
        memcpy(path + stem, ending, sizeof ending);
    }
    return path;
}

ToolPath *tool_path_create(Simulator *simulator, double duration_s)
{
    ToolPath *path = calloc(1, sizeof *path);
    const Stepper *stepper = simulator_stepper(simulator);
    int most = 0;
    if (!path)
        return NULL;
    path->duration_s = duration_s;
    path->tool_count = stepper_tool_count(stepper);
    for (int k = 0; k < path->tool_count; k++) {
        path->node_count[k] = stepper_tool_nodes(stepper, k, NULL);
        int nodes = scene_most_nodes(simulator_scene(simulator), k);
        most = nodes > most ? nodes : most;
    }
    if ((path->node = calloc((size_t)most, sizeof *path->node)))
        return path;
    tool_path_free(path);
    return NULL;
}

static bool reserve_rows(ToolPath *path, int rows)
{
    if (path->row_count + rows <= path->row_capacity)
        return true;
    int wanted = path->row_capacity * 2 + rows;
    PathRow *row = path->row_capacity < INT_MAX / 4 ? realloc(path->row, (size_t)wanted * sizeof *row) : NULL;
    if (!row)
        return false;
    path->row = row;
    path->row_capacity = wanted;
    return true;
}

bool tool_path_sample(ToolPath *path, Simulator *simulator, bool last)
{
    double dt_s = simulator_scene(simulator)->dt / 1000;
    int64_t steps = simulator_totals(simulator)->steps, every = (int64_t)fmax(1, floor(sample_s / dt_s + 0.5));
    bool due = steps % every == 0;
    // also sample the end if it lies between two samples
    if (last ? due || steps == 0 : !due)
        return true;
    if (!reserve_rows(path, SAMPLED_NODES * path->tool_count))
        return false;
    for (int k = 0; k < path->tool_count; k++) {
        int tip = stepper_tool_nodes(simulator_stepper(simulator), k, path->node) - 1, count = tip + 1 < SAMPLED_NODES ? tip + 1 : SAMPLED_NODES;
        for (int i = 0; i < count; i++) {
            int node = (int)((int64_t)i * tip / (count - 1));
            path->row[path->row_count++] = (PathRow){simulator_time_s(simulator), k, node, path->node[node].position};
        }
    }
    return true;
}

// Describes a difference in the tools' node counts.
static void compare_counts(const ToolPath *golden, const ToolPath *run, PathDifference *difference)
{
    size_t capacity = sizeof difference->remark;
    if (golden->tool_count != run->tool_count)
        snprintf(difference->remark, capacity, "%d tools, the golden has %d", run->tool_count, golden->tool_count);
    for (int k = 0; !difference->remark[0] && k < golden->tool_count; k++)
        if (golden->node_count[k] != run->node_count[k])
            snprintf(difference->remark, capacity, "%d nodes, the golden has %d", run->node_count[k], golden->node_count[k]);
    difference->differs = difference->remark[0];
}

PathDifference tool_path_compare(const ToolPath *golden, const ToolPath *run, double tolerance_mm)
{
    PathDifference difference = {.first_node = -1};
    compare_counts(golden, run, &difference);
    int j = 0, missing = 0;
    double first_missing = 0;
    for (int i = 0; i < golden->row_count; i++) {
        const PathRow *reference = &golden->row[i];
        double slack = time_slack(reference->t_s);
        while (j < run->row_count && comes_before(&run->row[j], reference, slack))
            j++;
        if (j == run->row_count || fabs(run->row[j].t_s - reference->t_s) > slack || run->row[j].tool != reference->tool ||
            run->row[j].node != reference->node) {
            first_missing = missing++ ? first_missing : reference->t_s;
            continue;
        }
        double distance = vec3_distance(run->row[j].position, reference->position);
        if (!(distance <= difference.worst_mm))
            difference.worst_mm = distance;
        if (!(distance <= tolerance_mm) && difference.first_node < 0) {
            difference.differs = true;
            difference.first_t_s = reference->t_s;
            difference.first_tool = reference->tool;
            difference.first_node = reference->node;
            difference.first_mm = distance;
        }
    }
    if (missing > 0) {
        difference.differs = true;
        size_t used = strlen(difference.remark);
        snprintf(difference.remark + used, sizeof difference.remark - used, "%s%d of %d golden rows have no counterpart, the first at %g s", used ? "; " : "",
                 missing, golden->row_count, first_missing);
    }
    return difference;
}
