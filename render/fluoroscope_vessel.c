#include "render/fluoroscope_vessel.h"

#include "geom/geom.h"
#include "render/gl_canvas.h"
#include "render/message.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

enum { FINE_TRIANGLES = 90000, COARSE_TRIANGLES = 25000 };

static const char *const LUMEN_VERTEX = "#version 330 core\n"
                                        "layout(location = 0) in vec3 position; layout(location = 1) in float node;\n"
                                        "uniform mat4 clip; uniform vec3 towards; uniform float shift; uniform samplerBuffer nodes; out float f;\n"
                                        "void main() { gl_Position = clip * vec4(position, 1.0); vec2 n = texelFetch(nodes, int(node + 0.5)).xy;\n"
                                        "  f = n.x + n.y * (dot(towards, position) + shift); }\n";
// the picture is seen from the detector: walls through which rays leave face the viewer
static const char *const LUMEN_FRAGMENT = "#version 330 core\n"
                                          "uniform float facing; in float f; out float result;\n"
                                          "void main() { result = gl_FrontFacing ? facing * f : -facing * f; }\n";

// --- meshes ---

static void send_mesh(LumenMesh *to, int vertices, const float (*vertex)[4], int triangles, const int (*triangle)[3])
{
    glGenVertexArrays(1, &to->array);
    glGenBuffers(1, &to->vertices);
    glGenBuffers(1, &to->indices);
    glBindVertexArray(to->array);
    glBindBuffer(GL_ARRAY_BUFFER, to->vertices);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)vertices * sizeof *vertex), vertex, GL_STATIC_DRAW);
    glEnableVertexAttribArray(0);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof *vertex, NULL);
    glEnableVertexAttribArray(1);
    glVertexAttribPointer(1, 1, GL_FLOAT, GL_FALSE, sizeof *vertex, (const void *)(3 * sizeof(float)));
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, to->indices);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)((size_t)triangles * sizeof *triangle), triangle, GL_STATIC_DRAW);
    glBindVertexArray(0);
    to->index_count = 3 * triangles;
}

static bool send_lumen(LumenMesh *to, const TriangleMesh *mesh, const int *node, Vec3 origin)
{
    float(*vertex)[4] = malloc(((size_t)mesh->vertex_count + 1) * sizeof *vertex);
    if (!vertex)
        return false;
    for (int v = 0; v < mesh->vertex_count; v++) {
        Vec3 p = vec3_sub(mesh->vertex[v], origin);
        const float entry[4] = {(float)p.x, (float)p.y, (float)p.z, (float)node[v]};
        memcpy(vertex[v], entry, sizeof entry);
    }
    send_mesh(to, mesh->vertex_count, (const float(*)[4])vertex, mesh->triangle_count, (const int(*)[3])mesh->triangle);
    bool good = wall_mesh_make(&to->wall, mesh->vertex_count, (const float(*)[4])vertex, mesh->triangle_count, (const int(*)[3])mesh->triangle);
    free(vertex);
    return good;
}

static void delete_mesh(LumenMesh *mesh)
{
    const unsigned buffer[2] = {mesh->vertices, mesh->indices};
    glDeleteBuffers(2, buffer);
    glDeleteVertexArrays(1, &mesh->array);
    wall_mesh_free(&mesh->wall);
}

// --- tree nodes of the vertices ---

static int nearest_node(const VesselTree *tree, Vec3 x)
{
    int best = 0;
    double least = HUGE_VAL;
    for (int n = 0; n < tree->node_count; n++) {
        double power = vec3_norm2(vec3_sub(x, tree->center[n])) - tree->radius[n] * tree->radius[n];
        if (power < least) {
            least = power;
            best = n;
        }
    }
    return best;
}

static int node_of_vertex(const FluoroscopeOptions *options, int v)
{
    const VesselTree *tree = options->tree;
    int node = !tree ? 0 : options->vertex_node ? options->vertex_node[v] : options->vessel->node ? options->vessel->node[v] : -1;
    return !tree ? 0 : node >= 0 && node < tree->node_count ? node : nearest_node(tree, options->vessel->vertex[v]);
}

// A copy with lids whose nodes are known. Returns NULL if out of memory.
static TriangleMesh *closed_copy(const FluoroscopeOptions *options, const MeshLids *lids)
{
    const TriangleMesh *mesh = options->vessel;
    size_t vertices = (size_t)mesh->vertex_count + (size_t)lids->middle_count, triangles = (size_t)mesh->triangle_count + (size_t)lids->triangle_count;
    TriangleMesh *copy = calloc(1, sizeof *copy);
    if (!copy)
        return NULL;
    copy->vertex = malloc((vertices + 1) * sizeof *copy->vertex);
    copy->normal = calloc(vertices + 1, sizeof *copy->normal);
    copy->node = malloc((vertices + 1) * sizeof *copy->node);
    copy->triangle = malloc((triangles + 1) * sizeof *copy->triangle);
    if (!copy->vertex || !copy->normal || !copy->node || !copy->triangle) {
        triangle_mesh_free(copy);
        return NULL;
    }
    copy->vertex_count = (int)vertices;
    copy->triangle_count = (int)triangles;
    memcpy(copy->vertex, mesh->vertex, (size_t)mesh->vertex_count * sizeof *copy->vertex);
    for (int v = 0; v < mesh->vertex_count; v++)
        copy->node[v] = node_of_vertex(options, v);
    for (int r = 0; r < lids->middle_count; r++) {
        copy->vertex[mesh->vertex_count + r] = lids->middle[r];
        copy->node[mesh->vertex_count + r] = copy->node[lids->middle_vertex[r]];
    }
    memcpy(copy->triangle, mesh->triangle, (size_t)mesh->triangle_count * sizeof *copy->triangle);
    memcpy(copy->triangle + mesh->triangle_count, lids->triangle, (size_t)lids->triangle_count * sizeof *copy->triangle);
    return copy;
}

static bool send_both(Lumen *lumen, const FluoroscopeOptions *options, const MeshLids *lids)
{
    TriangleMesh *closed = closed_copy(options, lids);
    TriangleMesh *fine = closed && closed->triangle_count > FINE_TRIANGLES ? cached_decimation(closed, FINE_TRIANGLES) : NULL;
    const TriangleMesh *shown = fine ? fine : closed;
    TriangleMesh *coarse = shown && shown->triangle_count > COARSE_TRIANGLES ? cached_decimation(shown, COARSE_TRIANGLES) : NULL;
    bool good = shown != NULL;
    if (good) {
        Vec3 low = shown->vertex[0], high = low;
        for (int v = 1; v < shown->vertex_count; v++) {
            Vec3 p = shown->vertex[v];
            low = vec3(fmin(low.x, p.x), fmin(low.y, p.y), fmin(low.z, p.z));
            high = vec3(fmax(high.x, p.x), fmax(high.y, p.y), fmax(high.z, p.z));
        }
        lumen->origin = vec3_mix(low, high, 0.5);
        lumen->low = vec3_sub(low, lumen->origin);
        lumen->high = vec3_sub(high, lumen->origin);
        good = send_lumen(&lumen->fine, shown, shown->node, lumen->origin);
        if (coarse)
            good = good && send_lumen(&lumen->coarse, coarse, coarse->node, lumen->origin);
    }
    triangle_mesh_free(closed);
    triangle_mesh_free(fine);
    triangle_mesh_free(coarse);
    return good;
}

static bool take_nodes(Lumen *lumen, const VesselTree *tree)
{
    lumen->node_count = tree ? tree->node_count : 1;
    size_t nodes = (size_t)lumen->node_count;
    lumen->parent = malloc(nodes * sizeof *lumen->parent);
    lumen->center = malloc(nodes * sizeof *lumen->center);
    lumen->shift_slope = calloc(nodes, sizeof *lumen->shift_slope);
    if (!lumen->parent || !lumen->center || !lumen->shift_slope)
        return false;
    for (size_t n = 0; n < nodes; n++) {
        lumen->parent[n] = tree ? tree->parent[n] : -1;
        lumen->center[n] = tree ? tree->center[n] : vec3(0, 0, 0);
    }
    glGenBuffers(1, &lumen->buffer);
    glGenTextures(1, &lumen->texture);
    glBindBuffer(GL_TEXTURE_BUFFER, lumen->buffer);
    glBufferData(GL_TEXTURE_BUFFER, (GLsizeiptr)(nodes * sizeof *lumen->shift_slope), lumen->shift_slope, GL_STREAM_DRAW);
    glBindTexture(GL_TEXTURE_BUFFER, lumen->texture);
    glTexBuffer(GL_TEXTURE_BUFFER, GL_RG32F, lumen->buffer);
    return true;
}

bool lumen_layer_create(Lumen *lumen, const FluoroscopeOptions *options, const MeshClosure *closure, const MeshLids *lids, char *message, size_t capacity)
{
    *lumen = (Lumen){.sign = closure->volume < 0 ? -1 : 1};
    lumen->program = gl_program_create(LUMEN_VERTEX, LUMEN_FRAGMENT, message, capacity);
    if (!lumen->program)
        return false;
    GLint most = 0;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &most);
    if (options->tree && options->tree->node_count > most)
        return message_fail(message, capacity, "a tree of %d nodes is too large for fluoroscopy; this driver allows %d", options->tree->node_count, (int)most);
    if (!take_nodes(lumen, options->tree) || !send_both(lumen, options, lids))
        return message_fail(message, capacity, "out of memory for the vessel in fluoroscopy");
    lumen->is_there = true;
    return true;
}

void lumen_layer_destroy(Lumen *lumen)
{
    if (lumen->program)
        glDeleteProgram(lumen->program);
    delete_mesh(&lumen->fine);
    delete_mesh(&lumen->coarse);
    glDeleteTextures(1, &lumen->texture);
    glDeleteBuffers(1, &lumen->buffer);
    free(lumen->parent);
    free(lumen->center);
    free(lumen->shift_slope);
    *lumen = (Lumen){0};
}

// --- drawing ---

static Vec3 box_corner(const Lumen *lumen, int corner)
{
    Vec3 p = {corner & 1 ? lumen->low.x : lumen->high.x, corner & 2 ? lumen->low.y : lumen->high.y, corner & 4 ? lumen->low.z : lumen->high.z};
    return vec3_add(lumen->origin, p);
}

bool lumen_is_in_beam(const Lumen *lumen, const CArm *c_arm)
{
    double nearest = HUGE_VAL;
    for (int corner = 0; corner < 8; corner++)
        nearest = fmin(nearest, c_arm_project(c_arm, box_corner(lumen, corner)).z + C_ARM_SOURCE_MM);
    return nearest > C_ARM_NEAREST_MM;
}

void lumen_box(const Lumen *lumen, const CArm *c_arm, int side, int low[2], int high[2])
{
    double least[2] = {HUGE_VAL, HUGE_VAL}, most[2] = {-HUGE_VAL, -HUGE_VAL};
    for (int corner = 0; corner < 8; corner++) {
        Vec3 p = c_arm_project(c_arm, box_corner(lumen, corner));
        const double at[2] = {p.x, p.y};
        for (int k = 0; k < 2; k++) {
            least[k] = fmin(least[k], (at[k] + 0.5) * side);
            most[k] = fmax(most[k], (at[k] + 0.5) * side);
        }
    }
    for (int k = 0; k < 2; k++) {
        low[k] = (int)fmin(fmax(floor(least[k]) - 4, 0), side);
        high[k] = (int)fmin(fmax(ceil(most[k]) + 4, 0), side);
    }
}

static bool find_nodes(Lumen *lumen, const CArm *c_arm, const float *concentration)
{
    // the integral of c dz along the tree, in double precision and from the plane of the isocentre, so that a long tree loses no precision
    double *potential = malloc((size_t)lumen->node_count * sizeof *potential);
    if (!potential)
        return false;
    for (int n = 0; n < lumen->node_count; n++) {
        int parent = lumen->parent[n];
        double c = concentration[n], z = vec3_dot(c_arm->towards, vec3_sub(lumen->center[n], c_arm->isocentre));
        if (parent < 0)
            potential[n] = c * z;
        else {
            double before = vec3_dot(c_arm->towards, vec3_sub(lumen->center[parent], c_arm->isocentre));
            potential[n] = potential[parent] + 0.5 * (c + (double)concentration[parent]) * (z - before);
        }
        lumen->shift_slope[n][0] = (float)(potential[n] - c * z);
        lumen->shift_slope[n][1] = (float)c;
    }
    free(potential);
    return true;
}

static void send_nodes(Lumen *lumen, const CArm *c_arm, const float *concentration)
{
    if (!find_nodes(lumen, c_arm, concentration))
        return;
    glBindBuffer(GL_TEXTURE_BUFFER, lumen->buffer);
    glBufferData(GL_TEXTURE_BUFFER, (GLsizeiptr)((size_t)lumen->node_count * sizeof *lumen->shift_slope), lumen->shift_slope, GL_STREAM_DRAW);
}

static LumenMesh *mesh_of(Lumen *lumen, bool coarse) { return coarse && lumen->coarse.index_count > 0 ? &lumen->coarse : &lumen->fine; }

static WallView view_of(const Lumen *lumen, const CArm *c_arm)
{
    WallView view = {.towards = {(float)c_arm->towards.x, (float)c_arm->towards.y, (float)c_arm->towards.z},
                     .shift = (float)vec3_dot(c_arm->towards, vec3_sub(lumen->origin, c_arm->isocentre)),
                     .facing = (float)(lumen->sign * c_arm->handedness),
                     .shift_slope = (const float(*)[2])lumen->shift_slope};
    c_arm_matrix(c_arm, lumen->origin, 0.5 * C_ARM_NEAREST_MM, 10 * C_ARM_SOURCE_MM, view.clip);
    return view;
}

void lumen_add(Lumen *lumen, const CArm *c_arm, const float *concentration, bool coarse, int side, float *value)
{
    const WallView view = view_of(lumen, c_arm);
    if (find_nodes(lumen, c_arm, concentration))
        lumen_raster(&mesh_of(lumen, coarse)->wall, &view, side, value);
}

void lumen_layer_draw(Lumen *lumen, const CArm *c_arm, const float *concentration, bool coarse)
{
    const LumenMesh *mesh = mesh_of(lumen, coarse);
    const WallView view = view_of(lumen, c_arm);
    unsigned program = lumen->program;
    send_nodes(lumen, c_arm, concentration);
    glUseProgram(program);
    glUniformMatrix4fv(glGetUniformLocation(program, "clip"), 1, GL_FALSE, view.clip);
    glUniform3fv(glGetUniformLocation(program, "towards"), 1, view.towards);
    glUniform1f(glGetUniformLocation(program, "shift"), view.shift);
    glUniform1f(glGetUniformLocation(program, "facing"), view.facing);
    glUniform1i(glGetUniformLocation(program, "nodes"), 0);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_BUFFER, lumen->texture);
    glEnable(GL_DEPTH_CLAMP);   // walls beyond the far plane count too
    glEnable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    glBlendFunc(GL_ONE, GL_ONE);
    glBindVertexArray(mesh->array);
    glDrawElements(GL_TRIANGLES, mesh->index_count, GL_UNSIGNED_INT, NULL);
    glBindVertexArray(0);
    glDisable(GL_BLEND);
    glDisable(GL_DEPTH_CLAMP);
}
