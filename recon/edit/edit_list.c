// Reads and prints lists of edits, see edit_list.h.
#include "recon/edit/edit_list.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_BYTES = 64 << 20, MOST_BRANCHES = 1 << 24 };
static const double LARGEST = 1e6;   // [mm] of a coordinate

static const char *const kind_name[] = {"section", "delete_section", "smooth", "blend", "branch", "cut", "tag", NULL};
static const char *const shape_name[] = {"circle", "ellipse", NULL};
static const char *const end_name[] = {"start", "end", NULL};
static const char *const tag_name[] = {"in", "out", "flip", NULL};

// --- reading ---

// [[a, b], …] or [[x, y, z], …]
static bool read_points(YamlValue list, int size, int least, SweepEdit *edit)
{
    int count = yaml_count(list, least, EDIT_MOST_POINTS);
    if (count < 0)
        return false;
    Vec3 *point = calloc((size_t)count, sizeof *point);
    if (!point) {
        yaml_fault(list, "needs more memory than is available");
        return false;
    }
    bool good = true;
    for (int i = 0; i < count; i++) {
        YamlValue item = yaml_item(list, i);
        double x[3] = {0, 0, 0};
        bool is_point = yaml_count(item, size, size) >= 0;
        for (int k = 0; is_point && k < size; k++)
            is_point = yaml_number(yaml_item(item, k), (NumberRange){-LARGEST, LARGEST, false}, &x[k]);
        good = good && is_point;
        point[i] = vec3(x[0], x[1], x[2]);
    }
    free(edit->point);
    edit->point = point, edit->count = count;
    return good;
}

static void read_t(const YamlMap *map, const char *key, double *t) { yaml_map_number(map, key, true, (NumberRange){0, LARGEST, false}, t); }

static void read_branch_number(const YamlMap *map, const char *key, int *branch)
{
    YamlValue value = yaml_get(map, key, true);
    if (!value.node)
        return;
    const char *text = yaml_scalar(value);
    if (text && !strcmp(text, "sac"))
        yaml_fault(value, "a sac consists of blobs and has no sections to edit; expected the number of a branch (`seldinger edit MODEL.h5 --list`)");
    else
        yaml_integer(value, 0, MOST_BRANCHES, branch);
}

static void read_section(YamlValue value, SweepEdit *edit)
{
    static const char *const keys[] = {"edit", "branch", "t_mm", "contour_nb_mm", "contour_mm", NULL};
    YamlMap map = yaml_map(value, keys);
    read_branch_number(&map, "branch", &edit->branch);
    read_t(&map, "t_mm", &edit->t);
    bool in_plane = yaml_has(&map, "contour_nb_mm");
    edit->in_space = yaml_has(&map, "contour_mm");
    if (in_plane == edit->in_space)
        yaml_fault(value, "%s; expected contour_nb_mm: [[n, b], …] in the section's plane, or contour_mm: [[x, y, z], …]",
                   in_plane ? "two contours are given" : "the contour is missing");
    else
        read_points(yaml_get(&map, in_plane ? "contour_nb_mm" : "contour_mm", true), in_plane ? 2 : 3, 3, edit);
}

static void read_delete(YamlValue value, SweepEdit *edit)
{
    static const char *const keys[] = {"edit", "branch", "t_mm", NULL};
    YamlMap map = yaml_map(value, keys);
    read_branch_number(&map, "branch", &edit->branch);
    read_t(&map, "t_mm", &edit->t);
}

static void read_smooth(YamlValue value, SweepEdit *edit)
{
    static const char *const keys[] = {"edit", "to", "strength", "branch", "t_mm", "from_mm", "to_mm", NULL};
    YamlMap map = yaml_map(value, keys);
    YamlValue to = yaml_get(&map, "to", true);
    int shape = to.node ? yaml_choice(to, shape_name) : 0;
    edit->shape = shape < 0 ? SMOOTH_CIRCLE : (SmoothShape)shape;
    yaml_map_number(&map, "strength", true, (NumberRange){0, 1, false}, &edit->amount);
    bool has_t = yaml_has(&map, "t_mm"), has_range = yaml_has(&map, "from_mm") || yaml_has(&map, "to_mm");
    edit->extent = has_t ? SMOOTH_SECTION : has_range ? SMOOTH_RANGE : yaml_has(&map, "branch") ? SMOOTH_BRANCH : SMOOTH_TREE;
    if (has_t && has_range)
        yaml_fault(value, "both a section and a range are given; expected t_mm, or from_mm and to_mm, or neither for the whole branch");
    if (edit->extent != SMOOTH_TREE)
        read_branch_number(&map, "branch", &edit->branch);
    if (has_t)
        read_t(&map, "t_mm", &edit->t);
    if (has_range) {
        read_t(&map, "from_mm", &edit->from);
        read_t(&map, "to_mm", &edit->to);
        if (yaml_has(&map, "from_mm") && yaml_has(&map, "to_mm") && edit->from > edit->to)
            yaml_fault(value, "the range ends before it begins; expected from_mm <= to_mm");
    }
}

static void read_blend(YamlValue value, SweepEdit *edit)
{
    static const char *const keys[] = {"edit", "branch", "width", NULL};
    YamlMap map = yaml_map(value, keys);
    read_branch_number(&map, "branch", &edit->branch);
    yaml_map_number(&map, "width", true, (NumberRange){0, 2, false}, &edit->amount);
}

static void read_new_branch(YamlValue value, SweepEdit *edit)
{
    static const char *const keys[] = {"edit", "parent", "t_mm", "points_mm", "radii_mm", NULL};
    YamlMap map = yaml_map(value, keys);
    read_branch_number(&map, "parent", &edit->branch);
    read_t(&map, "t_mm", &edit->t);
    YamlValue points = yaml_get(&map, "points_mm", true), radii = yaml_get(&map, "radii_mm", true);
    if (!points.node || !read_points(points, 3, 1, edit) || !radii.node || yaml_count(radii, edit->count, edit->count) < 0)
        return;
    edit->radius = calloc((size_t)edit->count, sizeof *edit->radius);
    for (int i = 0; edit->radius && i < edit->count; i++)
        yaml_number(yaml_item(radii, i), (NumberRange){0, 1000, true}, &edit->radius[i]);
    if (!edit->radius)
        yaml_fault(radii, "needs more memory than is available");
}

static void read_tag(YamlValue value, SweepEdit *edit)
{
    static const char *const keys[] = {"edit", "branch", "end", "as", NULL};
    YamlMap map = yaml_map(value, keys);
    read_branch_number(&map, "branch", &edit->branch);
    YamlValue end = yaml_get(&map, "end", true), as = yaml_get(&map, "as", true);
    edit->end = end.node ? yaml_choice(end, end_name) == 1 : 0;
    int tag = as.node ? yaml_choice(as, tag_name) : 0;
    edit->tag = tag < 0 ? EDIT_TAG_IN : (EditTag)tag;
}

static void read_edit(YamlValue value, SweepEdit *edit)
{
    static void (*const read[EDIT_KINDS])(YamlValue, SweepEdit *) = {read_section,    read_delete, read_smooth, read_blend,
                                                                     read_new_branch, read_delete, read_tag};
    yaml_place(value, &edit->line, &edit->column);
    YamlMap map = yaml_map(value, NULL);
    if (!map.value.node)
        return;
    YamlValue kind = yaml_get(&map, "edit", true);
    int k = kind.node ? yaml_choice(kind, kind_name) : -1;
    if (k < 0)
        return;
    edit->kind = (EditKind)k;
    read[k](value, edit);
}

// `keys`: those of the map; NULL: any, and `edits` may be missing.
static EditList *parse(const char *text, size_t length, const char *const *keys, const char *name, Faults *faults)
{
    int before = faults->count;
    if (length > MOST_BYTES) {
        faults_add(faults, name, 0, 0, "has %zu bytes; expected at most %d", length, (int)MOST_BYTES);
        return NULL;
    }
    YamlReader *reader = yaml_reader_open(text, length, name, faults);
    EditList *list = reader ? calloc(1, sizeof *list) : NULL;
    if (reader && !list)
        faults_add(faults, name, 0, 0, "needs more memory than is available");
    if (list) {
        YamlMap root = yaml_map(yaml_root(reader), keys);
        YamlValue items = root.value.node ? yaml_get(&root, "edits", keys != NULL) : (YamlValue){0};
        int count = items.node ? yaml_count(items, 0, EDIT_MOST_EDITS) : -1;
        list->edit = calloc((size_t)(count > 0 ? count : 1), sizeof *list->edit);
        if (!list->edit)
            faults_add(faults, name, 0, 0, "needs more memory than is available");
        else
            list->count = list->capacity = count > 0 ? count : 0;
        for (int i = 0; i < list->count; i++)
            read_edit(yaml_item(items, i), &list->edit[i]);
    }
    yaml_reader_close(reader);
    if (list && faults->count == before)
        return list;
    edit_list_free(list);
    return NULL;
}

EditList *edit_list_parse(const char *text, size_t length, const char *name, Faults *faults)
{
    static const char *const keys[] = {"edits", NULL};
    return parse(text, length, keys, name, faults);
}

EditList *edit_list_parse_within(const char *text, size_t length, const char *name, Faults *faults) { return parse(text, length, NULL, name, faults); }

EditList *edit_list_load(const char *path, Faults *faults)
{
    size_t length;
    char *text = whole_file_read(path, &length, faults);
    EditList *list = text ? edit_list_parse(text, length, path, faults) : NULL;
    free(text);
    return list;
}

void edit_clear(SweepEdit *edit)
{
    free(edit->point);
    free(edit->radius);
    *edit = (SweepEdit){0};
}

void edit_list_free(EditList *list)
{
    for (int i = 0; list && i < list->count; i++)
        edit_clear(&list->edit[i]);
    if (list)
        free(list->edit);
    free(list);
}

bool edit_copy(const SweepEdit *edit, SweepEdit *copy)
{
    *copy = *edit;
    size_t count = (size_t)edit->count;
    copy->point = edit->point ? malloc((count + 1) * sizeof *copy->point) : NULL;
    copy->radius = edit->radius ? malloc((count + 1) * sizeof *copy->radius) : NULL;
    if ((edit->point && !copy->point) || (edit->radius && !copy->radius)) {
        edit_clear(copy);
        return false;
    }
    if (edit->point)
        memcpy(copy->point, edit->point, count * sizeof *copy->point);
    if (edit->radius)
        memcpy(copy->radius, edit->radius, count * sizeof *copy->radius);
    return true;
}

// --- printing ---

typedef struct Line {
    char *text;
    size_t length, capacity;
    bool failed;
} Line;

__attribute__((format(printf, 2, 3))) static void put(Line *line, const char *format, ...)
{
    if (line->capacity - line->length < 256) {
        size_t capacity = 2 * line->capacity + 1024;
        char *more = line->failed ? NULL : realloc(line->text, capacity);
        if (!more) {
            line->failed = true;
            return;
        }
        line->text = more, line->capacity = capacity;
    }
    va_list arguments;
    va_start(arguments, format);
    line->length += (size_t)vsnprintf(line->text + line->length, line->capacity - line->length, format, arguments);
    va_end(arguments);
}

// The fewest digits that read back to the same bits.
static void put_number(Line *line, double x)
{
    char text[40];
    for (int digits = 6; digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, x);
        if (strtod(text, NULL) == x)
            break;
    }
    put(line, "%s", text);
}

static void put_key(Line *line, const char *key, double x)
{
    put(line, ", %s: ", key);
    put_number(line, x);
}

static void put_points(Line *line, const char *key, const SweepEdit *e, int size)
{
    put(line, ", %s: [", key);
    for (int i = 0; i < e->count; i++) {
        double x[3] = {e->point[i].x, e->point[i].y, e->point[i].z};
        for (int k = 0; k < size; k++) {
            put(line, "%s", k > 0 ? ", " : i > 0 ? ", [" : "[");
            put_number(line, x[k]);
        }
        put(line, "]");
    }
    put(line, "]");
}

static void put_smooth(Line *line, const SweepEdit *e)
{
    put(line, ", to: %s", shape_name[e->shape]);
    put_key(line, "strength", e->amount);
    if (e->extent != SMOOTH_TREE)
        put(line, ", branch: %d", e->branch);
    if (e->extent == SMOOTH_SECTION)
        put_key(line, "t_mm", e->t);
    if (e->extent == SMOOTH_RANGE)
        put_key(line, "from_mm", e->from), put_key(line, "to_mm", e->to);
}

static void put_radii(Line *line, const SweepEdit *e)
{
    put(line, ", radii_mm: [");
    for (int i = 0; i < e->count; i++) {
        put(line, "%s", i > 0 ? ", " : "");
        put_number(line, e->radius[i]);
    }
    put(line, "]");
}

char *edit_line(const SweepEdit *e)
{
    Line line = {0};
    SEL_ASSERT(e->kind >= 0 && e->kind < EDIT_KINDS, "an edit has a kind");
    put(&line, "{edit: %s", kind_name[e->kind]);
    if (e->kind == EDIT_BRANCH)
        put(&line, ", parent: %d", e->branch);
    else if (e->kind != EDIT_SMOOTH)
        put(&line, ", branch: %d", e->branch);
    if (e->kind == EDIT_SECTION || e->kind == EDIT_DELETE_SECTION || e->kind == EDIT_BRANCH || e->kind == EDIT_CUT)
        put_key(&line, "t_mm", e->t);
    if (e->kind == EDIT_SECTION)
        put_points(&line, e->in_space ? "contour_mm" : "contour_nb_mm", e, e->in_space ? 3 : 2);
    if (e->kind == EDIT_SMOOTH)
        put_smooth(&line, e);
    if (e->kind == EDIT_BLEND)
        put_key(&line, "width", e->amount);
    if (e->kind == EDIT_BRANCH) {
        put_points(&line, "points_mm", e, 3);
        put_radii(&line, e);
    }
    if (e->kind == EDIT_TAG)
        put(&line, ", end: %s, as: %s", end_name[e->end != 0], tag_name[e->tag]);
    put(&line, "}");
    if (line.failed) {
        free(line.text);
        return NULL;
    }
    return line.text;
}

char *edit_text_add(char *text, const SweepEdit *edit)
{
    static const char start[] = "edits:\n";
    char *item = edit_line(edit);
    size_t length = text ? strlen(text) : sizeof start - 1;
    char *all = item ? malloc(length + strlen(item) + 4) : NULL;
    if (all) {
        memcpy(all, text ? text : start, length);
        memcpy(all + length, "- ", 2);
        memcpy(all + length + 2, item, strlen(item));
        memcpy(all + length + 2 + strlen(item), "\n", 2);
    }
    free(item);
    free(text);
    return all;
}
