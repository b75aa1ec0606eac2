// Implements surface_file.h. Text formats are read by a cursor over a NUL-terminated copy; after an error the cursor stays invalid.
#include "recon/surface/surface_file.h"

#include "base/base.h"
#include "recon/surface/vtp_file.h"

#include <limits.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static const double COORDINATE_MAX = 1e9;
enum { COUNT_MAX = 100000000, SURFACE_BYTES_MOST = INT_MAX };

// A mesh while it is being read.
typedef struct Growing {
    SurfaceMesh mesh;
    int vertex_capacity, triangle_capacity;
    const char *name;
    Faults *faults;
    bool bad;
} Growing;

static void fault_memory(Growing *g)
{
    if (!g->bad)
        faults_add(g->faults, g->name, 0, 0, "not enough memory");
    g->bad = true;
}

static void fault_line(Growing *g, int line, const char *what)
{
    if (!g->bad)
        faults_add(g->faults, g->name, line, 0, "%s", what);
    g->bad = true;
}

static void fault_byte(Growing *g, size_t offset, const char *what)
{
    if (!g->bad)
        faults_add_at_byte(g->faults, g->name, offset, "%s", what);
    g->bad = true;
}

static bool add_vertex(Growing *g, Vec3 p)
{
    SurfaceMesh *m = &g->mesh;
    if (m->vertex_count == g->vertex_capacity) {
        int capacity = 2 * g->vertex_capacity + 1024;
        Vec3 *grown = capacity < COUNT_MAX * 2 ? realloc(m->vertex, (size_t)capacity * sizeof *grown) : NULL;
        if (!grown) {
            fault_memory(g);
            return false;
        }
        m->vertex = grown;
        g->vertex_capacity = capacity;
    }
    m->vertex[m->vertex_count++] = p;
    return true;
}

static bool add_triangle(Growing *g, int a, int b, int c)
{
    SurfaceMesh *m = &g->mesh;
    if (m->triangle_count == g->triangle_capacity) {
        int capacity = 2 * g->triangle_capacity + 1024;
        int(*grown)[3] = capacity < COUNT_MAX * 2 ? realloc(m->triangle, (size_t)capacity * sizeof *grown) : NULL;
        if (!grown) {
            fault_memory(g);
            return false;
        }
        m->triangle = grown;
        g->triangle_capacity = capacity;
    }
    int *t = m->triangle[m->triangle_count++];
    t[0] = a, t[1] = b, t[2] = c;
    return true;
}

static bool good_point(Vec3 p) { return vec3_is_finite(p) && fabs(p.x) < COORDINATE_MAX && fabs(p.y) < COORDINATE_MAX && fabs(p.z) < COORDINATE_MAX; }

static const char *const bad_coordinate = "a coordinate is not a finite number below 1e9; expected three numbers";

// --- text ---

typedef struct Cursor {
    const char *at;
    int line;
} Cursor;

// Skips spaces within a line.
static void skip_blanks(Cursor *c)
{
    while (*c->at == ' ' || *c->at == '\t' || *c->at == '\r')
        c->at++;
}

static void skip_space(Cursor *c)
{
    for (; *c->at == ' ' || *c->at == '\t' || *c->at == '\r' || *c->at == '\n'; c->at++)
        c->line += *c->at == '\n';
}

static void skip_line(Cursor *c)
{
    while (*c->at && *c->at != '\n')
        c->at++;
    if (*c->at)
        c->at++, c->line++;
}

// Returns true if the given word (case-insensitive) is at the cursor, and moves the cursor past it.
static bool take_word(Cursor *c, const char *word)
{
    size_t n = strlen(word);
    if (strncasecmp(c->at, word, n) || !(c->at[n] == '\0' || strchr(" \t\r\n", c->at[n])))
        return false;
    c->at += n;
    return true;
}

// Reads a number on the current line.
static bool take_number(Cursor *c, double *value)
{
    char *end;
    skip_blanks(c);
    if (*c->at == '\n' || *c->at == '\0')
        return false;
    *value = strtod(c->at, &end);
    if (end == c->at || !(*end == '\0' || strchr(" \t\r\n", *end)))
        return false;
    c->at = end;
    return true;
}

static bool take_point(Cursor *c, Vec3 *p) { return take_number(c, &p->x) && take_number(c, &p->y) && take_number(c, &p->z) && good_point(*p); }

// --- STL ---

static void parse_stl_text(Growing *g, const char *text)
{
    Cursor c = {text, 1};
    int corner = 0;
    bool ended = false;
    for (skip_line(&c); *c.at && !g->bad;) {
        skip_space(&c);
        if (!*c.at)
            break;
        if (take_word(&c, "vertex")) {
            Vec3 p;
            if (!take_point(&c, &p))
                fault_line(g, c.line, bad_coordinate);
            else if (++corner > 3)
                fault_line(g, c.line, "a facet has more than 3 vertices");
            else if (add_vertex(g, p) && corner == 3)
                add_triangle(g, g->mesh.vertex_count - 3, g->mesh.vertex_count - 2, g->mesh.vertex_count - 1);
        } else if (take_word(&c, "endfacet")) {
            if (corner != 3)
                fault_line(g, c.line, "a facet ends with fewer than 3 vertices");
            corner = 0;
        } else if (take_word(&c, "solid")) {
            ended = false;
        } else if (take_word(&c, "endsolid")) {
            ended = true;
        } else if (!take_word(&c, "facet") && !take_word(&c, "outer") && !take_word(&c, "endloop"))
            fault_line(g, c.line, "not an STL keyword; expected facet, outer loop, vertex, endloop, endfacet, endsolid");
        if (!g->bad)
            skip_line(&c);
    }
    if (corner != 0)
        fault_line(g, c.line, "ends within a facet");
    else if (!ended)
        fault_line(g, c.line, "ends without endsolid: the file is truncated");
}

static float float_at(const unsigned char *bytes, bool big)
{
    uint32_t word = 0;
    for (int i = 0; i < 4; i++)
        word = word << 8 | bytes[big ? i : 3 - i];
    float value;
    memcpy(&value, &word, 4);
    return value;
}

static uint32_t stl_count(const unsigned char *bytes)
{
    return (uint32_t)bytes[80] | (uint32_t)bytes[81] << 8 | (uint32_t)bytes[82] << 16 | (uint32_t)bytes[83] << 24;
}

static void parse_stl_binary(Growing *g, const unsigned char *bytes, size_t length)
{
    uint32_t count = stl_count(bytes);
    if (84 + 50 * (uint64_t)count != length) {
        faults_add_at_byte(g->faults, g->name, 80, "the header gives %u triangles, which need %llu bytes, but the file has %zu", count,
                           (unsigned long long)(84 + 50 * (uint64_t)count), length);
        g->bad = true;
        return;
    }
    for (uint32_t t = 0; t < count && !g->bad; t++) {
        const unsigned char *at = bytes + 84 + 50 * (size_t)t + 12;
        for (int k = 0; k < 3 && !g->bad; k++, at += 12) {
            Vec3 p = vec3((double)float_at(at, false), (double)float_at(at + 4, false), (double)float_at(at + 8, false));
            if (!good_point(p))
                fault_byte(g, (size_t)(at - bytes), bad_coordinate);
            else
                add_vertex(g, p);
        }
        if (!g->bad)
            add_triangle(g, g->mesh.vertex_count - 3, g->mesh.vertex_count - 2, g->mesh.vertex_count - 1);
    }
}

// --- OBJ ---

// Parses the vertex of `7`, `7/1`, `7/1/3`, `-1`. Returns its index from 0, or -1 if it is invalid.
static int take_obj_index(Cursor *c, int vertex_count)
{
    char *end;
    skip_blanks(c);
    long index = strtol(c->at, &end, 10);
    if (end == c->at)
        return -1;
    c->at = end;
    while (*c->at == '/' || *c->at == '-' || (*c->at >= '0' && *c->at <= '9'))
        c->at++;
    index = index < 0 ? index + vertex_count : index - 1;
    return index >= 0 && index < vertex_count ? (int)index : -1;
}

static void parse_obj(Growing *g, const char *text)
{
    for (Cursor c = {text, 1}; *c.at && !g->bad; skip_line(&c)) {
        skip_blanks(&c);
        if (take_word(&c, "v")) {
            Vec3 p;
            if (!take_point(&c, &p))
                fault_line(g, c.line, bad_coordinate);
            else
                add_vertex(g, p);
        } else if (take_word(&c, "f")) {
            int first = -1, before = -1, corners = 0;
            for (skip_blanks(&c); *c.at && *c.at != '\n' && *c.at != '#' && !g->bad; skip_blanks(&c)) {
                int at = take_obj_index(&c, g->mesh.vertex_count);
                if (at < 0 || (*c.at && !strchr(" \t\r\n", *c.at)))
                    fault_line(g, c.line,
                               "a face refers to a vertex that does not exist; expected indices from 1, or from -1 backwards, of the vertices above");
                else if (++corners >= 3)
                    add_triangle(g, first, before, at);
                first = corners == 1 ? at : first;
                before = at;
            }
            if (corners < 3)
                fault_line(g, c.line, "a face has fewer than 3 vertices");
        }
    }
}

// --- PLY ---

enum { PLY_TEXT, PLY_LITTLE, PLY_BIG };
enum { PROPERTIES = 32, ELEMENTS = 8 };

typedef struct PlyProperty {
    int size, list_size;     // bytes of a value, and of a list's count; 0: not a list
    bool is_float, is_signed, list_signed;
    int role;                // 0, 1, 2: x, y, z; 3: the list of vertices; -1: ignored
} PlyProperty;
typedef struct PlyElement {
    long count;
    int kind;                // 0: vertex, 1: face, 2: other
    int property_count;
    PlyProperty property[PROPERTIES];
} PlyElement;
typedef struct PlyBody {     // binary or text data, read in order
    Cursor text;
    const unsigned char *bytes;
    size_t at, length;
    int format;
} PlyBody;

static bool ply_type(Cursor *c, int *size, bool *is_float, bool *is_signed)
{
    static const struct {
        const char *name;
        int size;
        bool is_float, is_signed;
    } types[] = {{"char", 1, false, true},  {"int8", 1, false, true},   {"uchar", 1, false, false},  {"uint8", 1, false, false},
                 {"short", 2, false, true}, {"int16", 2, false, true},  {"ushort", 2, false, false}, {"uint16", 2, false, false},
                 {"int", 4, false, true},   {"int32", 4, false, true},  {"uint", 4, false, false},   {"uint32", 4, false, false},
                 {"float", 4, true, true},  {"float32", 4, true, true}, {"double", 8, true, true},   {"float64", 8, true, true}};
    skip_blanks(c);
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++)
        if (take_word(c, types[i].name)) {
            *size = types[i].size;
            *is_float = types[i].is_float;
            *is_signed = types[i].is_signed;
            return true;
        }
    return false;
}

static void ply_header_property(Growing *g, Cursor *c, PlyElement *e)
{
    PlyProperty p = {.role = -1};
    bool unused;
    if (e->property_count == PROPERTIES) {
        fault_line(g, c->line, "an element has more than 32 properties");
        return;
    }
    skip_blanks(c);
    bool is_list = take_word(c, "list");
    if ((is_list && (!ply_type(c, &p.list_size, &unused, &p.list_signed) || unused)) || !ply_type(c, &p.size, &p.is_float, &p.is_signed)) {
        fault_line(g, c->line, "a property has an unknown type; expected char uchar short ushort int uint float double");
        return;
    }
    skip_blanks(c);
    static const char *const names[] = {"x", "y", "z", "vertex_indices", "vertex_index"};
    for (int i = 0; i < 5; i++)
        if (take_word(c, names[i]) && (i > 2) == is_list)
            p.role = i > 3 ? 3 : i;
    e->property[e->property_count++] = p;
}

// Parses the header and returns the number of elements; leaves the cursor on the line after end_header.
static int ply_header(Growing *g, Cursor *c, PlyElement *element, int *format)
{
    int count = 0;
    *format = -1;
    for (skip_line(c); !g->bad; skip_line(c)) {
        skip_blanks(c);
        if (!*c->at) {
            fault_line(g, c->line, "the header has no end_header");
        } else if (take_word(c, "end_header")) {
            skip_line(c);
            break;
        } else if (take_word(c, "format")) {
            skip_blanks(c);
            *format = take_word(c, "ascii") ? PLY_TEXT : take_word(c, "binary_little_endian") ? PLY_LITTLE : take_word(c, "binary_big_endian") ? PLY_BIG : -1;
        } else if (take_word(c, "element")) {
            double number;
            skip_blanks(c);
            int kind = take_word(c, "vertex") ? 0 : take_word(c, "face") ? 1 : 2;
            while (*c->at && !strchr(" \t\r\n", *c->at))
                c->at++;
            if (!take_number(c, &number) || !(number >= 0 && number <= COUNT_MAX) || floor(number) != number || count == ELEMENTS)
                fault_line(g, c->line, "an element has no count of 0 to 1e8, or there are more than 8");
            else
                element[count++] = (PlyElement){.count = (long)number, .kind = kind};
        } else if (take_word(c, "property")) {
            if (count == 0)
                fault_line(g, c->line, "a property comes before any element");
            else
                ply_header_property(g, c, &element[count - 1]);
        }
    }
    if (!g->bad && *format < 0)
        fault_line(g, 2, "unknown format; expected ascii, binary_little_endian or binary_big_endian");
    return count;
}

static bool ply_value(PlyBody *body, int size, bool is_float, bool is_signed, double *value)
{
    if (body->format == PLY_TEXT) {
        skip_space(&body->text);
        return take_number(&body->text, value);
    }
    if ((size_t)size > body->length - body->at)
        return false;
    const unsigned char *at = body->bytes + body->at;
    body->at += (size_t)size;
    uint64_t word = 0;
    for (int i = 0; i < size; i++)
        word = word << 8 | at[body->format == PLY_BIG ? i : size - 1 - i];
    if (is_float && size == 8)
        memcpy(value, &word, 8);
    else if (is_float)
        *value = (double)float_at(at, body->format == PLY_BIG);
    else
        *value = is_signed ? (double)((int64_t)(word << (64 - 8 * size)) >> (64 - 8 * size)) : (double)word;
    return true;
}

static void ply_fault(Growing *g, const PlyBody *body, const char *what)
{
    if (body->format == PLY_TEXT)
        fault_line(g, body->text.line, what);
    else
        fault_byte(g, body->at, what);
}

static void ply_entry(Growing *g, PlyBody *body, const PlyElement *e, int vertex_count)
{
    double number, coordinate[3] = {NAN, NAN, NAN};
    for (int k = 0; k < e->property_count && !g->bad; k++) {
        const PlyProperty *p = &e->property[k];
        double entries = 1;
        if (p->list_size && (!ply_value(body, p->list_size, false, p->list_signed, &entries) || !(entries >= 0 && entries <= COUNT_MAX))) {
            ply_fault(g, body, "is truncated, or a list has no count");
            return;
        }
        int first = -1, before = -1;
        for (int i = 0; !g->bad && i < (int)entries; i++) {
            if (!ply_value(body, p->size, p->is_float, p->is_signed, &number))
                ply_fault(g, body, "is truncated or holds something that is not a number");
            else if (e->kind == 1 && p->role == 3) {
                if (!(number >= 0 && number < vertex_count) || floor(number) != number) {
                    ply_fault(g, body, "a face refers to a vertex that does not exist");
                    break;
                }
                int at = (int)number;
                if (i >= 2)
                    add_triangle(g, first, before, at);
                first = i == 0 ? at : first;
                before = at;
            } else if (e->kind == 0 && p->role >= 0 && p->role < 3)
                coordinate[p->role] = number;
        }
    }
    if (e->kind == 0 && !g->bad) {
        Vec3 v = vec3(coordinate[0], coordinate[1], coordinate[2]);
        if (!good_point(v))
            ply_fault(g, body, bad_coordinate);
        else
            add_vertex(g, v);
    }
}

static void parse_ply(Growing *g, const char *text, size_t length)
{
    PlyElement *element = calloc(ELEMENTS, sizeof *element);
    Cursor c = {text, 1};
    PlyBody body = {.bytes = (const unsigned char *)text, .length = length};
    if (!element) {
        fault_memory(g);
        return;
    }
    int count = ply_header(g, &c, element, &body.format), vertices = 0;
    body.text = c;
    body.at = (size_t)(c.at - text);
    for (int i = 0; i < count; i++)
        vertices += element[i].kind == 0 ? (int)element[i].count : 0;
    for (int i = 0; i < count && !g->bad; i++)
        for (long k = 0; k < element[i].count && element[i].property_count > 0 && !g->bad; k++)
            ply_entry(g, &body, &element[i], vertices);
    for (int t = 0; t < g->mesh.triangle_count && !g->bad; t++)
        for (int k = 0; k < 3 && !g->bad; k++)
            if (g->mesh.triangle[t][k] >= g->mesh.vertex_count)
                fault_line(g, 0, "a face refers to a vertex that does not exist");
    free(element);
}

// --- VTP ---

static void parse_vtp(Growing *g, const char *bytes, size_t length)
{
    VtpData *data = vtp_parse(bytes, length, g->name, g->faults);
    g->bad = !data;
    for (int i = 0; data && i < data->point_count && !g->bad; i++)
        add_vertex(g, data->point[i]);
    for (int i = 0; data && i < data->polygon.count && !g->bad; i++)
        for (int k = data->polygon.offset[i] + 2; k < data->polygon.offset[i + 1]; k++)
            add_triangle(g, data->polygon.index[data->polygon.offset[i]], data->polygon.index[k - 1], data->polygon.index[k]);
    for (int i = 0; data && i < data->strip.count && !g->bad; i++)
        for (int k = data->strip.offset[i] + 2; k < data->strip.offset[i + 1]; k++) {
            const int *at = data->strip.index + k;
            bool odd = (k - data->strip.offset[i]) % 2 != 0;
            add_triangle(g, at[odd ? -1 : -2], at[odd ? -2 : -1], at[0]);
        }
    vtp_free(data);
}

// --- format detection ---

typedef enum { KIND_NONE, KIND_STL_TEXT, KIND_STL_BINARY, KIND_PLY, KIND_OBJ, KIND_VTP } Kind;

static bool name_ends(const char *name, const char *end)
{
    size_t n = strlen(name), m = strlen(end);
    return n >= m && !strcasecmp(name + n - m, end);
}

// `whole`: the bytes are the complete file.
static Kind kind_of(const char *text, size_t length, const char *name, bool whole)
{
    Cursor c = {text, 1};
    if (length >= 84 && whole && 84 + 50 * (uint64_t)stl_count((const unsigned char *)text) == length)
        return KIND_STL_BINARY;
    if (length >= 4 && !memcmp(text, "ply", 3) && (text[3] == '\n' || text[3] == '\r'))
        return KIND_PLY;
    skip_space(&c);
    if (!strncmp(c.at, "<?xml", 5) || !strncmp(c.at, "<VTKFile", 8))
        return KIND_VTP;
    if (take_word(&c, "solid") && !(name_ends(name, ".stl") && length >= 84 && memchr(text, 0, 84)))
        return KIND_STL_TEXT;
    if (name_ends(name, ".stl") && length >= 84)
        return KIND_STL_BINARY;
    for (int line = 0; *c.at && line < 200; skip_line(&c), line++) {
        skip_blanks(&c);
        if (*c.at == '#' || *c.at == '\n' || *c.at == '\0')
            continue;
        static const char *const words[] = {"v", "vn", "vt", "f", "o", "g", "s", "mtllib", "usemtl"};
        for (size_t i = 0; i < sizeof words / sizeof words[0]; i++)
            if (take_word(&c, words[i]))
                return KIND_OBJ;
        break;
    }
    return KIND_NONE;
}

SurfaceMesh *surface_parse(const void *bytes, size_t length, const char *name, Faults *faults)
{
    Growing g = {.name = name, .faults = faults};
    char *text = malloc(length + 1);
    SurfaceMesh *mesh = calloc(1, sizeof *mesh);
    if (!text || !mesh)
        fault_memory(&g);
    else {
        if (length)
            memcpy(text, bytes, length);
        text[length] = '\0';
        switch (kind_of(text, length, name, true)) {
        case KIND_STL_TEXT: parse_stl_text(&g, text); break;
        case KIND_STL_BINARY: parse_stl_binary(&g, (const unsigned char *)text, length); break;
        case KIND_PLY: parse_ply(&g, text, length); break;
        case KIND_OBJ: parse_obj(&g, text); break;
        case KIND_VTP: parse_vtp(&g, text, length); break;
        default: fault_line(&g, 0, "is not a known surface format; expected STL, PLY, OBJ or VTK XML PolyData (.vtp)");
        }
    }
    if (!g.bad && g.mesh.triangle_count == 0)
        fault_line(&g, 0, "has no triangle");
    if (!g.bad)
        *mesh = g.mesh;
    else {
        free(g.mesh.vertex);
        free(g.mesh.triangle);
        free(mesh);
        mesh = NULL;
    }
    free(text);
    return mesh;
}

SurfaceMesh *surface_load(const char *path, Faults *faults)
{
    size_t length;
    char *bytes = whole_file_read_most(path, SURFACE_BYTES_MOST, &length, faults);
    SurfaceMesh *mesh = bytes ? surface_parse(bytes, length, path, faults) : NULL;
    free(bytes);
    return mesh;
}

bool surface_is_known(const void *head, size_t length, const char *name)
{
    char text[513];
    size_t n = length < 512 ? length : 512;
    memcpy(text, head, n);
    text[n] = '\0';
    return kind_of(text, n, name, false) != KIND_NONE;
}

void surface_free(SurfaceMesh *mesh)
{
    if (!mesh)
        return;
    free(mesh->vertex);
    free(mesh->triangle);
    free(mesh);
}
