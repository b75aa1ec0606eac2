#include "sim/compare.h"

#include "input/number_table.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char header[] = "t_s,node,x_mm,y_mm,z_mm";
static const double sample_s = 0.05;
enum { SAMPLED_NODES = 21 };

// The figure of a comment line "# name: figure"; `missing` where there is none.
static double comment_figure(const char *text, size_t length, const char *name, double missing)
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

ToolPath *tool_path_parse(const char *text, size_t length, const char *file, Faults *faults)
{
    int before = faults->count;
    NumberTable *table = number_table_parse(text, length, file, header, faults);
    if (!table)
        return NULL;
    ToolPath *path = calloc(1, sizeof *path);
    if (path)
        path->row = calloc((size_t)table->row_count + 1, sizeof *path->row);
    if (!path || !path->row) {
        faults_add(faults, file, 0, 0, "no memory for its rows");
    } else {
        double nodes = comment_figure(text, length, "nodes", -1);
        path->duration_s = comment_figure(text, length, "duration_s", -1);
        path->row_count = path->row_capacity = table->row_count;
        if (nodes < 2 || nodes > 1e6 || nodes != floor(nodes))
            faults_add(faults, file, 1, 1, "lacks the comment '# nodes: N' with the tool's number of nodes; make the file with `seldinger check --update`");
        else
            path->node_count = (int)nodes;
        if (path->duration_s < 0 || path->duration_s > SCRIPT_LONGEST_S)
            faults_add(faults, file, 1, 1, "lacks the comment '# duration_s: S'; make the file with `seldinger check --update`");
        for (int i = 0; i < table->row_count; i++) {
            const double *value = table->value + (size_t)i * 5;
            if (value[1] < 0 || value[1] > INT_MAX || value[1] != floor(value[1]))
                faults_add(faults, file, table->line[i], 1, "node %g is no whole number of at least 0", value[1]);
            else
                path->row[i] = (PathRow){value[0], (int)value[1], vec3(value[2], value[3], value[4])};
        }
        if (table->row_count == 0)
            faults_add(faults, file, 0, 0, "has no row; make the file with `seldinger check --update`");
    }
    number_table_free(table);
    if (faults->count > before) {
        tool_path_free(path);
        return NULL;
    }
    return path;
}

char *tool_path_print(const ToolPath *path, size_t *length)
{
    char *text = NULL;
    FILE *stream = open_memstream(&text, length);
    if (!stream)
        return NULL;
    fprintf(stream, "# seldinger golden tool path; made by `seldinger check --update`\n# nodes: %d\n# duration_s: %.9g\n%s\n", path->node_count,
            path->duration_s, header);
    for (int i = 0; i < path->row_count; i++) {
        const PathRow *row = &path->row[i];
        // + 0.0 turns a minus zero, which rounding can leave, into zero
        fprintf(stream, "%.6g,%d,%.7f,%.7f,%.7f\n", row->t_s, row->node, round(row->position.x * 1e7) / 1e7 + 0.0,
                round(row->position.y * 1e7) / 1e7 + 0.0, round(row->position.z * 1e7) / 1e7 + 0.0);
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

ToolPath *tool_path_create(const Simulator *simulator, double duration_s)
{
    ToolPath *path = calloc(1, sizeof *path);
    if (path) {
        path->node_count = simulator_state(simulator)->node_count;
        path->duration_s = duration_s;
    }
    return path;
}

bool tool_path_sample(ToolPath *path, const Simulator *simulator, bool last)
{
    double dt_s = simulator_scene(simulator)->dt / 1000;
    int64_t steps = simulator_totals(simulator)->steps, every = (int64_t)fmax(1, floor(sample_s / dt_s + 0.5));
    bool due = steps % every == 0;
    // the end is sampled where it falls between two samples
    if (last ? due || steps == 0 : !due)
        return true;
    if (path->row_count + SAMPLED_NODES > path->row_capacity) {
        int wanted = path->row_capacity * 2 + SAMPLED_NODES;
        PathRow *row = path->row_capacity < INT_MAX / 4 ? realloc(path->row, (size_t)wanted * sizeof *row) : NULL;
        if (!row)
            return false;
        path->row = row;
        path->row_capacity = wanted;
    }
    const WireState *state = simulator_state(simulator);
    int tip = state->node_count - 1, count = tip + 1 < SAMPLED_NODES ? tip + 1 : SAMPLED_NODES;
    for (int i = 0; i < count; i++) {
        int node = (int)((int64_t)i * tip / (count - 1));
        path->row[path->row_count++] = (PathRow){simulator_time_s(simulator), node, state->position[node]};
    }
    return true;
}

PathDifference tool_path_compare(const ToolPath *golden, const ToolPath *run, double tolerance_mm)
{
    PathDifference difference = {.first_node = -1};
    if (golden->node_count != run->node_count) {
        difference.differs = true;
        snprintf(difference.remark, sizeof difference.remark, "%d nodes, the golden has %d", run->node_count, golden->node_count);
    }
    int j = 0, missing = 0;
    double first_missing = 0;
    for (int i = 0; i < golden->row_count; i++) {
        const PathRow *want = &golden->row[i];
        // both are sorted by time and node; times are printed with six digits
        double slack = 1e-5 * fmax(1, fabs(want->t_s));
        while (j < run->row_count &&
               (run->row[j].t_s < want->t_s - slack || (fabs(run->row[j].t_s - want->t_s) <= slack && run->row[j].node < want->node)))
            j++;
        if (j == run->row_count || fabs(run->row[j].t_s - want->t_s) > slack || run->row[j].node != want->node) {
            first_missing = missing++ ? first_missing : want->t_s;
            continue;
        }
        double distance = vec3_distance(run->row[j].position, want->position);
        if (!(distance <= difference.worst_mm))
            difference.worst_mm = distance;
        if (!(distance <= tolerance_mm) && difference.first_node < 0) {
            difference.differs = true;
            difference.first_t_s = want->t_s;
            difference.first_node = want->node;
            difference.first_mm = distance;
        }
    }
    if (missing > 0) {
        difference.differs = true;
        size_t used = strlen(difference.remark);
        snprintf(difference.remark + used, sizeof difference.remark - used, "%s%d of %d golden rows have no counterpart, the first at %g s",
                 used ? "; " : "", missing, golden->row_count, first_missing);
    }
    return difference;
}
