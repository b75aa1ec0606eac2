#include "recon/surface/surface_write.h"

#include "recon/surface/vtp_write.h"

#include <string.h>

static void put_float(FILE *out, double value)
{
    float single = (float)value;
    uint32_t bits;
    memcpy(&bits, &single, sizeof bits);
    for (int i = 0; i < 4; i++)
        fputc((int)(bits >> (8 * i) & 0xff), out);
}

static void put_vector(FILE *out, Vec3 v)
{
    put_float(out, v.x);
    put_float(out, v.y);
    put_float(out, v.z);
}

void surface_print_stl(FILE *out, const SurfaceFigures *surface)
{
    const TriangleMesh *mesh = surface->mesh;
    char head[81] = "seldinger " SELDINGER_VERSION ", mm";
    fwrite(head, 1, 80, out);
    for (int i = 0; i < 4; i++)
        fputc((int)((unsigned)mesh->triangle_count >> (8 * i) & 0xff), out);
    for (int i = 0; i < mesh->triangle_count; i++) {
        Vec3 corner[3];
        for (int j = 0; j < 3; j++)
            corner[j] = mesh->vertex[mesh->triangle[i][j]];
        put_vector(out, vec3_unit_or(vec3_cross(vec3_sub(corner[1], corner[0]), vec3_sub(corner[2], corner[0])), vec3(0, 0, 0)));
        for (int j = 0; j < 3; j++)
            put_vector(out, corner[j]);
        fputc(0, out);
        fputc(0, out);
    }
}

void surface_print_ply(FILE *out, const SurfaceFigures *surface)
{
    const TriangleMesh *mesh = surface->mesh;
    fprintf(out,
            "ply\nformat ascii 1.0\ncomment seldinger " SELDINGER_VERSION ", mm\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
            "property float nx\nproperty float ny\nproperty float nz\nproperty int node\n%s%selement face %d\nproperty list uchar int vertex_indices\n"
            "end_header\n",
            mesh->vertex_count, surface->error ? "property float error_mm\nproperty float data_mm\n" : "",
            surface->branch ? "property int branch\nproperty float along_mm\nproperty int boundary\nproperty int flow\n" : "", mesh->triangle_count);
    for (int i = 0; i < mesh->vertex_count; i++) {
        fprintf(out, "%.9g %.9g %.9g %.6g %.6g %.6g %d", mesh->vertex[i].x, mesh->vertex[i].y, mesh->vertex[i].z, mesh->normal[i].x, mesh->normal[i].y,
                mesh->normal[i].z, mesh->node[i]);
        if (surface->error)
            fprintf(out, " %.6g %.6g", surface->error[i], surface->distance[i]);
        if (surface->branch)
            fprintf(out, " %d %.9g %d %d", surface->branch[i], surface->along[i], surface->boundary[i], surface->flow[i]);
        fputc('\n', out);
    }
    for (int i = 0; i < mesh->triangle_count; i++)
        fprintf(out, "3 %d %d %d\n", mesh->triangle[i][0], mesh->triangle[i][1], mesh->triangle[i][2]);
}

void surface_print_obj(FILE *out, const SurfaceFigures *surface)
{
    const TriangleMesh *mesh = surface->mesh;
    fprintf(out, "# seldinger " SELDINGER_VERSION ", mm\n");
    for (int i = 0; i < mesh->vertex_count; i++)
        fprintf(out, "v %.9g %.9g %.9g\n", mesh->vertex[i].x, mesh->vertex[i].y, mesh->vertex[i].z);
    for (int i = 0; i < mesh->vertex_count; i++)
        fprintf(out, "vn %.6g %.6g %.6g\n", mesh->normal[i].x, mesh->normal[i].y, mesh->normal[i].z);
    for (int i = 0; i < mesh->triangle_count; i++) {
        const int *t = mesh->triangle[i];
        fprintf(out, "f %d//%d %d//%d %d//%d\n", t[0] + 1, t[0] + 1, t[1] + 1, t[1] + 1, t[2] + 1, t[2] + 1);
    }
}

static void print_tags(FILE *out, const char *name, const int *tag, int count)
{
    vtp_array(out, "Int32", name, 1);
    for (int i = 0; i < count; i++)
        fprintf(out, "%d\n", tag[i]);
    vtp_array_end(out);
}

void surface_print_vtp(FILE *out, const SurfaceFigures *surface)
{
    const TriangleMesh *mesh = surface->mesh;
    vtp_begin(out, mesh->vertex_count, 0, mesh->triangle_count);
    fprintf(out, "<PointData Normals=\"Normals\" Scalars=\"%s\">\n", surface->error ? "error_mm" : "node");
    vtp_vectors(out, "Normals", mesh->normal, mesh->vertex_count);
    vtp_array(out, "Int32", "node", 1);
    for (int i = 0; i < mesh->vertex_count; i++)
        fprintf(out, "%d\n", mesh->node[i]);
    vtp_array_end(out);
    if (surface->error) {
        vtp_numbers(out, "error_mm", surface->error, mesh->vertex_count);
        vtp_numbers(out, "data_mm", surface->distance, mesh->vertex_count);
    }
    if (surface->branch) {
        print_tags(out, "branch", surface->branch, mesh->vertex_count);
        vtp_numbers(out, "along_mm", surface->along, mesh->vertex_count);
        print_tags(out, "boundary", surface->boundary, mesh->vertex_count);
        print_tags(out, "flow", surface->flow, mesh->vertex_count);
    }
    fprintf(out, "</PointData>\n");
    vtp_points(out, mesh->vertex, mesh->vertex_count);
    fprintf(out, "<Polys>\n");
    vtp_array(out, "Int64", "connectivity", 1);
    for (int i = 0; i < mesh->triangle_count; i++)
        fprintf(out, "%d %d %d\n", mesh->triangle[i][0], mesh->triangle[i][1], mesh->triangle[i][2]);
    vtp_array_end(out);
    vtp_array(out, "Int64", "offsets", 1);
    for (int i = 0; i < mesh->triangle_count; i++)
        fprintf(out, "%d\n", 3 * (i + 1));
    vtp_array_end(out);
    fprintf(out, "</Polys>\n");
    vtp_end(out);
}
