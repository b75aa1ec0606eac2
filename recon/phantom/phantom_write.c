#include "recon/phantom/phantom_write.h"

#include "base/base.h"
#include "recon/phantom/phantom_parts.h"
#include "recon/tree_file.h"
#include "recon/volume/volume_file.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

// Prints the bone blocks, which are not part of the vessel.
static void print_blocks(FILE *out, const Shape *shape)
{
    int blocks;
    const ShapeBlock *block = shape_blocks(shape, &blocks);
    for (int i = 0; i < blocks; i++) {
        fprintf(out, "block_%d: {center_mm: [%.9g, %.9g, %.9g], half_mm: [%.9g, %.9g, %.9g], axes: [", i, block[i].center.x, block[i].center.y,
                block[i].center.z, block[i].half.x, block[i].half.y, block[i].half.z);
        for (int k = 0; k < 3; k++)
            fprintf(out, "%s[%.9g, %.9g, %.9g]", k ? ", " : "", block[i].axis[k].x, block[i].axis[k].y, block[i].axis[k].z);
        fprintf(out, "]}\n");
    }
}

static bool save_tree(const PhantomFiles *files, const Shape *shape, const VesselTree *tree, const char *path, Faults *faults)
{
    char *parameters = NULL;
    size_t length = 0;
    FILE *out = open_memstream(&parameters, &length);
    if (out) {
        fprintf(out, "shape: %s\n", files->name);
        for (int i = 0; i < files->option_count; i++)
            fprintf(out, "%s: %s\n", files->option[i][0], files->option[i][1]);
        fprintf(out, "voxel_mm: %g\n", shape_voxel_mm(shape));
        print_blocks(out, shape);
    }
    bool good = out && fclose(out) == 0;
    TreeFileInfo info = {
        .source = (char *)(size_t)files->name, .parameters = parameters, .created_by = (char *)(size_t) "seldinger " SELDINGER_VERSION " synth"};
    if (!good)
        faults_add(faults, path, 0, 0, "not enough memory");
    good = good && tree_file_save(tree, &info, path, faults);
    free(parameters);
    return good;
}

static bool write_stl(const TriangleMesh *mesh, const char *path, Faults *faults)
{
    size_t room = 84 + 50 * (size_t)mesh->triangle_count;
    unsigned char *bytes = calloc(room, 1);
    if (!bytes) {
        faults_add(faults, path, 0, 0, "not enough memory");
        return false;
    }
    snprintf((char *)bytes, 80, "seldinger " SELDINGER_VERSION " synth, mm");
    uint32_t count = (uint32_t)mesh->triangle_count;
    memcpy(bytes + 80, &count, 4);   // little-endian, as this machine is
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *v = mesh->triangle[t];
        Vec3 a = mesh->vertex[v[0]], b = mesh->vertex[v[1]], c = mesh->vertex[v[2]];
        Vec3 n = vec3_unit_or(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)), vec3(0, 0, 0));
        const float number[12] = {(float)n.x, (float)n.y, (float)n.z, (float)a.x, (float)a.y, (float)a.z,
                                  (float)b.x, (float)b.y, (float)b.z, (float)c.x, (float)c.y, (float)c.z};
        memcpy(bytes + 84 + 50 * (size_t)t, number, sizeof number);
    }
    bool good = output_write(path, bytes, room, faults);
    free(bytes);
    return good;
}

static bool write_ply(const TriangleMesh *mesh, const char *path, Faults *faults)
{
    char *text = NULL;
    size_t length = 0;
    FILE *out = open_memstream(&text, &length);
    if (out) {
        fprintf(out,
                "ply\nformat ascii 1.0\ncomment seldinger " SELDINGER_VERSION
                " synth, mm\nelement vertex %d\nproperty double x\nproperty double y\nproperty double z\nproperty float nx\nproperty float ny\n"
                "property float nz\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n",
                mesh->vertex_count, mesh->triangle_count);
        for (int i = 0; i < mesh->vertex_count; i++)
            fprintf(out, "%.9g %.9g %.9g %.6g %.6g %.6g\n", mesh->vertex[i].x, mesh->vertex[i].y, mesh->vertex[i].z, mesh->normal[i].x, mesh->normal[i].y,
                    mesh->normal[i].z);
        for (int t = 0; t < mesh->triangle_count; t++)
            fprintf(out, "3 %d %d %d\n", mesh->triangle[t][0], mesh->triangle[t][1], mesh->triangle[t][2]);
    }
    bool written = out && !ferror(out);
    written = out && fclose(out) == 0 && written;
    if (!written)
        faults_add(faults, path, 0, 0, "not enough memory");
    written = written && output_write(path, text, length, faults);
    free(text);
    return written;
}

// Derives a file name, for example F.stl -> F-truth.h5.
static void beside(const char *output, const char *extension, const char *what, char *path, size_t capacity)
{
    snprintf(path, capacity, "%.*s-%s.h5", (int)(strlen(output) - strlen(extension)), output, what);
}

static bool write_volume(const PhantomFiles *files, const Shape *shape, const char *path, FILE *out, Faults *faults)
{
    VolumeOptions options = files->volume;
    options.seed = shape->seed + 1;
    Volume *volume = shape_volume(shape, &options, faults);
    bool good = volume && volume_save_nrrd(volume, path, options.contrast_grey > 0 ? "uint8" : "float", faults);
    if (good && out)
        fprintf(out, "%d x %d x %d voxels of %g x %g x %g mm\n", volume->size[0], volume->size[1], volume->size[2], options.voxel_mm[0], options.voxel_mm[1],
                options.voxel_mm[2]);
    volume_free(volume);
    return good;
}

static bool write_surface(const PhantomFiles *files, const Shape *shape, const char *path, bool is_stl, FILE *out, Faults *faults)
{
    TriangleMesh *mesh = shape_surface(shape, files->cell_mm, faults);
    bool good = mesh && (is_stl ? write_stl(mesh, path, faults) : write_ply(mesh, path, faults));
    if (good && out)
        fprintf(out, "%d vertices, %d triangles\n", mesh->vertex_count, mesh->triangle_count);
    triangle_mesh_free(mesh);
    return good;
}

static bool write_neighbour(const PhantomFiles *files, const Shape *neighbour, const char *path, Faults *faults)
{
    VesselTree *tree = shape_sample(neighbour, faults);
    bool good = tree && save_tree(files, neighbour, tree, path, faults);
    vessel_tree_free(tree);
    return good;
}

bool phantom_write(const PhantomFiles *files, const Shape *shape, const char *path, FILE *out, Faults *faults)
{
    char extension[16], truth[4096];
    output_extension(path, extension);
    bool is_tree = !strcmp(extension, ".h5") || !strcmp(extension, ".hdf5"), is_volume = !strcmp(extension, ".nrrd");
    bool is_stl = !strcmp(extension, ".stl"), is_ply = !strcmp(extension, ".ply");
    if (!is_tree && !is_volume && !is_stl && !is_ply) {
        faults_add(faults, path, 0, 0, "unknown extension; expected .h5, .stl, .ply or .nrrd");
        return false;
    }
    VesselTree *tree = shape_sample(shape, faults);
    bool good = tree && (is_tree     ? save_tree(files, shape, tree, path, faults)
                         : is_volume ? write_volume(files, shape, path, out, faults)
                                     : write_surface(files, shape, path, is_stl, out, faults));
    if (good && is_tree && out)
        fprintf(out, "%d nodes, %lld points\n", tree->node_count, (long long)tree->point_count);
    if (good && !is_tree) {
        beside(path, extension, "truth", truth, sizeof truth);
        good = save_tree(files, shape, tree, truth, faults);
    }
    const Shape *neighbour = shape_neighbour(shape);
    beside(path, extension, "neighbour", truth, sizeof truth);
    good = good && (!neighbour || write_neighbour(files, neighbour, truth, faults));
    vessel_tree_free(tree);
    return good;
}
