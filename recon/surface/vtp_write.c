#include "recon/surface/vtp_write.h"

void vtp_begin(FILE *out, int points, int lines, int polygons)
{
    fprintf(out,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\">\n<PolyData>\n"
            "<Piece NumberOfPoints=\"%d\" NumberOfVerts=\"0\" NumberOfLines=\"%d\" NumberOfStrips=\"0\" NumberOfPolys=\"%d\">\n",
            points, lines, polygons);
}

void vtp_array(FILE *out, const char *type, const char *name, int components)
{
    fprintf(out, "<DataArray type=\"%s\" Name=\"%s\" NumberOfComponents=\"%d\" format=\"ascii\">\n", type, name, components);
}

void vtp_array_end(FILE *out) { fprintf(out, "</DataArray>\n"); }

void vtp_numbers(FILE *out, const char *name, const double *value, int count)
{
    vtp_array(out, "Float64", name, 1);
    for (int i = 0; i < count; i++)
        fprintf(out, "%.9g\n", value[i]);
    vtp_array_end(out);
}

void vtp_vectors(FILE *out, const char *name, const Vec3 *value, int count)
{
    vtp_array(out, "Float64", name, 3);
    for (int i = 0; i < count; i++)
        fprintf(out, "%.9g %.9g %.9g\n", value[i].x, value[i].y, value[i].z);
    vtp_array_end(out);
}

void vtp_points(FILE *out, const Vec3 *value, int count)
{
    fprintf(out, "<Points>\n");
    vtp_vectors(out, "Points", value, count);
    fprintf(out, "</Points>\n");
}

void vtp_end(FILE *out) { fprintf(out, "</Piece>\n</PolyData>\n</VTKFile>\n"); }
