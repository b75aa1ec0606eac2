// Implements centreline_file.h. SWC has lines `id type x y z radius parent` (Cannon et al. 1998); a curve runs from one fork to the next or to an end.
#include "recon/surface/centreline_file.h"

#include "base/base.h"
#include "recon/surface/vtp_file.h"

#include <cjson/cJSON.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { CENTRELINE_BYTES_MOST = 1 << 28 };

static const double COORDINATE_MAX = 1e9;

CurveSet *curve_set_create(void)
{
    CurveSet *set = calloc(1, sizeof *set);
    int *offset = calloc(1, sizeof *offset);
    if (!set || !offset) {
        free(set);
        free(offset);
        return NULL;
    }
    set->offset = offset;
    return set;
}

void curve_set_free(CurveSet *set)
{
    if (!set)
        return;
    free(set->point);
    free(set->radius);
    free(set->offset);
    free(set);
}

bool curve_set_add(CurveSet *set, const Vec3 *point, const double *radius, int count)
{
    if (count < 2)
        return true;
    size_t room = (size_t)set->point_count + (size_t)count;
    Vec3 *p = room < INT_MAX ? realloc(set->point, room * sizeof *p) : NULL;
    set->point = p ? p : set->point;
    double *r = p ? realloc(set->radius, room * sizeof *r) : NULL;
    set->radius = r ? r : set->radius;
    int *offset = r ? realloc(set->offset, ((size_t)set->curve_count + 2) * sizeof *offset) : NULL;
    set->offset = offset ? offset : set->offset;
    if (!offset)
        return false;
    int first = set->point_count, at = first;
    for (int i = 0; i < count; i++) {
        if (at > first && vec3_distance(point[i], set->point[at - 1]) < 1e-9)
            continue;
        set->point[at] = point[i];
        set->radius[at++] = radius && isfinite(radius[i]) && radius[i] > 0 ? radius[i] : 0;
    }
    if (at < first + 2)
        return true;
    set->point_count = at;
    set->offset[++set->curve_count] = at;
    return true;
}

static bool good_point(Vec3 p) { return vec3_is_finite(p) && fabs(p.x) < COORDINATE_MAX && fabs(p.y) < COORDINATE_MAX && fabs(p.z) < COORDINATE_MAX; }

// --- VTP ---

static void parse_vtp(const void *bytes, size_t length, const char *name, CurveSet *set, Faults *faults)
{
    VtpData *data = vtp_parse(bytes, length, name, faults);
    if (!data)
        return;
    Vec3 *point = malloc(((size_t)data->line.count ? (size_t)data->line.offset[data->line.count] + 1 : 1) * sizeof *point);
    double *radius = malloc(((size_t)data->line.count ? (size_t)data->line.offset[data->line.count] + 1 : 1) * sizeof *radius);
    bool good = point && radius;
    for (int i = 0; good && i < data->line.count; i++) {
        int first = data->line.offset[i], count = data->line.offset[i + 1] - first;
        for (int k = 0; k < count; k++) {
            point[k] = data->point[data->line.index[first + k]];
            radius[k] = data->radius ? data->radius[data->line.index[first + k]] : 0;
        }
        good = curve_set_add(set, point, radius, count);
    }
    if (!good)
        faults_add(faults, name, 0, 0, "not enough memory");
    free(point);
    free(radius);
    vtp_free(data);
}

// --- Markups ---

static bool read_position(const cJSON *point, Vec3 *out)
{
    const cJSON *position = cJSON_GetObjectItemCaseSensitive(point, "position");
    double v[3];
    if (!cJSON_IsArray(position) || cJSON_GetArraySize(position) != 3)
        return false;
    for (int k = 0; k < 3; k++) {
        const cJSON *number = cJSON_GetArrayItem(position, k);
        if (!cJSON_IsNumber(number))
            return false;
        v[k] = number->valuedouble;
    }
    *out = vec3(v[0], v[1], v[2]);
    return good_point(*out);
}

static void parse_markup(const cJSON *markup, int index, const char *name, CurveSet *set, Faults *faults)
{
    const cJSON *type = cJSON_GetObjectItemCaseSensitive(markup, "type"), *list = cJSON_GetObjectItemCaseSensitive(markup, "controlPoints"), *entry;
    const cJSON *unit = cJSON_GetObjectItemCaseSensitive(markup, "coordinateUnits");
    int count = cJSON_IsArray(list) ? cJSON_GetArraySize(list) : 0, k = 0;
    if (!cJSON_IsString(type) || strcmp(type->valuestring, "Curve")) {
        faults_add(faults, name, 0, 0, "markup %d has type '%s'; expected Curve", index, cJSON_IsString(type) ? type->valuestring : "none");
        return;
    }
    if (cJSON_IsString(unit) && strcmp(unit->valuestring, "mm")) {
        faults_add(faults, name, 0, 0, "markup %d is in '%s'; expected mm", index, unit->valuestring);
        return;
    }
    if (count < 2) {
        faults_add(faults, name, 0, 0, "markup %d has %d control points; expected two or more", index, count);
        return;
    }
    Vec3 *point = calloc((size_t)count, sizeof *point);
    double *radius = calloc((size_t)count, sizeof *radius);
    if (!point || !radius) {
        faults_add(faults, name, 0, 0, "not enough memory");
        count = 0;
    }
    bool good = true;
    if (count)
        cJSON_ArrayForEach(entry, list)
        {
            if (good && !read_position(entry, &point[k])) {
                faults_add(faults, name, 0, 0, "markup %d, control point %d has no position of three finite numbers", index, k);
                good = false;
            }
            k++;
        }
    if (count && good)
        cJSON_ArrayForEach(entry, cJSON_GetObjectItemCaseSensitive(markup, "measurements"))
        {
            const cJSON *title = cJSON_GetObjectItemCaseSensitive(entry, "name"), *values = cJSON_GetObjectItemCaseSensitive(entry, "controlPointValues"),
                        *value;
            if (!cJSON_IsString(title) || strcasecmp(title->valuestring, "radius") || !cJSON_IsArray(values))
                continue;
            if (cJSON_GetArraySize(values) != count) {
                faults_add(faults, name, 0, 0, "markup %d has %d radii for %d control points", index, cJSON_GetArraySize(values), count);
                good = false;
                break;
            }
            k = 0;
            cJSON_ArrayForEach(value, values) radius[k++] = cJSON_IsNumber(value) ? value->valuedouble : 0;
        }
    if (count && good && !curve_set_add(set, point, radius, count))
        faults_add(faults, name, 0, 0, "not enough memory");
    free(point);
    free(radius);
}

static void parse_json(const char *text, size_t length, const char *name, CurveSet *set, Faults *faults)
{
    const char *end = text;
    cJSON *root = cJSON_ParseWithLengthOpts(text, length + 1, &end, false);
    if (!root) {
        int line = 1, column = 1;
        for (const char *at = text; at < end && at < text + length; at++) {
            column = *at == '\n' ? 1 : column + 1;
            line += *at == '\n';
        }
        faults_add(faults, name, line, column, "is not valid JSON");
        return;
    }
    const cJSON *list = cJSON_GetObjectItemCaseSensitive(root, "markups"), *markup;
    int index = 0;
    if (!cJSON_IsArray(list) || cJSON_GetArraySize(list) == 0)
        faults_add(faults, name, 0, 0, "has no markups; expected a 3D Slicer Markups file with a Curve");
    else
        cJSON_ArrayForEach(markup, list) parse_markup(markup, index++, name, set, faults);
    cJSON_Delete(root);
}

// --- SWC ---

typedef struct Sample {
    long id, parent_id;
    int parent, children, line;
    Vec3 point;
    double radius;
} Sample;

static int compare_samples(const void *a, const void *b)
{
    const Sample *x = a, *y = b;
    if (x->id != y->id)
        return x->id < y->id ? -1 : 1;
    return (x->line > y->line) - (x->line < y->line);
}

static int find_sample(const Sample *sample, int count, long id)
{
    int low = 0, high = count;
    while (low < high) {
        int middle = low + (high - low) / 2;
        if (sample[middle].id < id)
            low = middle + 1;
        else
            high = middle;
    }
    return low < count && sample[low].id == id ? low : -1;
}

// Adds the curves of an SWC file. A curve ends upstream at a fork, at a root, or where the chain ends; it is collected from its downstream end.
static bool add_swc_curves(const Sample *sample, int count, CurveSet *set)
{
    Vec3 *point = malloc(((size_t)count + 1) * sizeof *point);
    double *radius = malloc(((size_t)count + 1) * sizeof *radius);
    bool good = point && radius;
    for (int i = 0; good && i < count; i++) {
        if (sample[i].children == 1)
            continue;
        int n = 0;
        for (int at = i; at >= 0 && n <= count; at = sample[at].parent) {
            point[n] = sample[at].point;
            radius[n++] = sample[at].radius;
            if (at != i && sample[at].children > 1)
                break;
        }
        for (int k = 0; k < n / 2; k++) {
            Vec3 p = point[k];
            double r = radius[k];
            point[k] = point[n - 1 - k];
            radius[k] = radius[n - 1 - k];
            point[n - 1 - k] = p;
            radius[n - 1 - k] = r;
        }
        good = curve_set_add(set, point, radius, n);
    }
    free(point);
    free(radius);
    return good;
}

static bool parse_swc_line(const char *at, Sample *sample)
{
    double number[7];
    for (int k = 0; k < 7; k++) {
        char *end;
        while (*at == ' ' || *at == '\t')
            at++;
        if (*at == '\n' || *at == '\r' || !*at)
            return false;
        number[k] = strtod(at, &end);
        if (end == at)
            return false;
        at = end;
    }
    if (!(fabs(number[0]) < 1e15) || !(fabs(number[6]) < 1e15))
        return false;
    *sample = (Sample){.id = (long)number[0], .parent_id = (long)number[6], .parent = -1, .point = vec3(number[2], number[3], number[4]), .radius = number[5]};
    return good_point(sample->point) && isfinite(sample->radius);
}

static void parse_swc(const char *text, const char *name, CurveSet *set, Faults *faults)
{
    int count = 0, capacity = 0, line = 0;
    Sample *sample = NULL;
    for (const char *at = text; *at;) {
        line++;
        const char *start = at + strspn(at, " \t\r");
        if (*start && *start != '#' && *start != '\n') {
            if (count == capacity) {
                capacity = 2 * capacity + 256;
                Sample *grown = capacity < INT_MAX / 4 ? realloc(sample, (size_t)capacity * sizeof *grown) : NULL;
                if (!grown) {
                    faults_add(faults, name, 0, 0, "not enough memory");
                    free(sample);
                    return;
                }
                sample = grown;
            }
            if (!parse_swc_line(start, &sample[count])) {
                faults_add(faults, name, line, 0, "is not an SWC file; expected seven numbers (id type x y z radius parent)");
                free(sample);
                return;
            }
            sample[count++].line = line;
        }
        at += strcspn(at, "\n");
        at += *at == '\n';
    }
    if (count)
        qsort(sample, (size_t)count, sizeof *sample, compare_samples);
    for (int i = 0; i < count; i++) {
        if (i > 0 && sample[i].id == sample[i - 1].id)
            faults_add(faults, name, sample[i].line, 0, "duplicate id %ld", sample[i].id);
        if (sample[i].parent_id < 0)
            continue;
        sample[i].parent = find_sample(sample, count, sample[i].parent_id);
        if (sample[i].parent < 0 || sample[i].parent == i) {
            faults_add(faults, name, sample[i].line, 0, "parent %ld does not exist", sample[i].parent_id);
            sample[i].parent = -1;
        } else
            sample[sample[i].parent].children++;
    }
    int before = set->curve_count;
    if (faults->count == 0 && !add_swc_curves(sample, count, set))
        faults_add(faults, name, 0, 0, "not enough memory");
    if (faults->count == 0 && set->curve_count == before)
        faults_add(faults, name, 0, 0, "has no curve of two points");
    free(sample);
}

// Adds a fault from a complete message.
static void faults_add_text(Faults *faults, const char *text)
{
    if (faults->count < FAULTS_CAPACITY)
        memcpy(faults->text[faults->count], text, FAULT_LENGTH);
    faults->count++;
}

bool centreline_parse(const void *bytes, size_t length, const char *name, CurveSet *set, Faults *faults)
{
    Faults *own = calloc(1, sizeof *own);
    char *text = malloc(length + 1);
    int curves = set->curve_count, points = set->point_count;
    if (!text || !own) {
        free(text);
        free(own);
        faults_add(faults, name, 0, 0, "not enough memory");
        return false;
    }
    if (length)
        memcpy(text, bytes, length);
    text[length] = '\0';
    const char *start = text + strspn(text, " \t\r\n\xEF\xBB\xBF");
    if (*start == '<')
        parse_vtp(text, length, name, set, own);
    else if (*start == '{')
        parse_json(text, length, name, set, own);
    else if (*start == '#' || *start == '-' || (*start >= '0' && *start <= '9'))
        parse_swc(text, name, set, own);
    else
        faults_add(own, name, 0, 0, "is not a known centreline format; expected VTK XML PolyData (.vtp), 3D Slicer Markups (.mrk.json) or SWC");
    if (own->count == 0 && set->curve_count == curves)
        faults_add(own, name, 0, 0, "has no line of two points");
    bool good = own->count == 0;
    if (!good) {
        set->curve_count = curves;
        set->point_count = points;
    }
    for (int i = 0; i < own->count && i < FAULTS_CAPACITY; i++)
        faults_add_text(faults, own->text[i]);
    free(text);
    free(own);
    return good;
}

bool centreline_load(const char *path, CurveSet *set, Faults *faults)
{
    size_t length;
    char *bytes = whole_file_read_most(path, CENTRELINE_BYTES_MOST, &length, faults);
    bool good = bytes && centreline_parse(bytes, length, path, set, faults);
    free(bytes);
    return good;
}

// --- output ---

static bool name_ends(const char *name, const char *end)
{
    size_t n = strlen(name), m = strlen(end);
    return n >= m && !strcasecmp(name + n - m, end);
}

static void write_vtp(FILE *out, const CurveSet *set)
{
    fprintf(out,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\">\n<PolyData>\n"
            "<Piece NumberOfPoints=\"%d\" NumberOfVerts=\"0\" NumberOfLines=\"%d\" NumberOfStrips=\"0\" NumberOfPolys=\"0\">\n"
            "<PointData Scalars=\"MaximumInscribedSphereRadius\">\n"
            "<DataArray type=\"Float64\" Name=\"MaximumInscribedSphereRadius\" format=\"ascii\">\n",
            set->point_count, set->curve_count);
    for (int i = 0; i < set->point_count; i++)
        fprintf(out, "%.9g\n", set->radius[i]);
    fprintf(out, "</DataArray>\n</PointData>\n<Points>\n<DataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\" format=\"ascii\">\n");
    for (int i = 0; i < set->point_count; i++)
        fprintf(out, "%.9g %.9g %.9g\n", set->point[i].x, set->point[i].y, set->point[i].z);
    fprintf(out, "</DataArray>\n</Points>\n<Lines>\n<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">\n");
    for (int i = 0; i < set->point_count; i++)
        fprintf(out, "%d\n", i);
    fprintf(out, "</DataArray>\n<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">\n");
    for (int i = 1; i <= set->curve_count; i++)
        fprintf(out, "%d\n", set->offset[i]);
    fprintf(out, "</DataArray>\n</Lines>\n</Piece>\n</PolyData>\n</VTKFile>\n");
}

static void write_markups(FILE *out, const CurveSet *set)
{
    fprintf(out, "{\n\"@schema\": \"https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/"
                 "markups-schema-v1.0.3.json#\",\n\"markups\": [");
    for (int c = 0; c < set->curve_count; c++) {
        fprintf(out, "%s\n{\"type\": \"Curve\", \"coordinateSystem\": \"LPS\", \"coordinateUnits\": \"mm\", \"controlPoints\": [", c ? "," : "");
        for (int i = set->offset[c]; i < set->offset[c + 1]; i++)
            fprintf(out, "%s\n{\"id\": \"%d\", \"label\": \"%d-%d\", \"position\": [%.9g, %.9g, %.9g], \"positionStatus\": \"defined\"}",
                    i > set->offset[c] ? "," : "", i - set->offset[c] + 1, c + 1, i - set->offset[c] + 1, set->point[i].x, set->point[i].y, set->point[i].z);
        fprintf(out, "],\n\"measurements\": [{\"name\": \"Radius\", \"enabled\": true, \"units\": \"mm\", \"controlPointValues\": [");
        for (int i = set->offset[c]; i < set->offset[c + 1]; i++)
            fprintf(out, "%s%.9g", i > set->offset[c] ? ", " : "", set->radius[i]);
        fprintf(out, "]}]}");
    }
    fprintf(out, "\n]}\n");
}

// Writes SWC. A curve that begins at a point of another curve has that point as parent.
static void write_swc(FILE *out, const CurveSet *set)
{
    fprintf(out, "# id type x_mm y_mm z_mm radius_mm parent\n");
    for (int c = 0; c < set->curve_count; c++)
        for (int i = set->offset[c]; i < set->offset[c + 1]; i++) {
            int parent = i > set->offset[c] ? i : -1;
            for (int k = 0; parent < 0 && k < set->offset[c]; k++)
                if (vec3_distance(set->point[k], set->point[i]) < 1e-9)
                    parent = k + 1;
            fprintf(out, "%d 0 %.9g %.9g %.9g %.9g %d\n", i + 1, set->point[i].x, set->point[i].y, set->point[i].z, set->radius[i], parent);
        }
}

char *centreline_text(const CurveSet *set, const char *name, size_t *length, Faults *faults)
{
    void (*write)(FILE *, const CurveSet *) = name_ends(name, ".vtp")        ? write_vtp
                                              : name_ends(name, ".mrk.json") ? write_markups
                                              : name_ends(name, ".swc")      ? write_swc
                                                                             : NULL;
    if (!write) {
        faults_add(faults, name, 0, 0, "unknown centreline extension; expected .vtp, .mrk.json or .swc");
        return NULL;
    }
    char *text = NULL;
    FILE *out = open_memstream(&text, length);
    if (out)
        write(out, set);
    bool good = out && !ferror(out);
    if (out)
        good = fclose(out) == 0 && good;
    if (!good) {
        faults_add(faults, name, 0, 0, "not enough memory");
        free(text);
        text = NULL;
    }
    return text;
}
