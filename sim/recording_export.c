#include "sim/recording_export.h"

#include "base/base.h"
#include "recon/recon.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

static void print_place(FILE *out, Vec3 x, Quat q) { fprintf(out, "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g", x.x, x.y, x.z, q.w, q.x, q.y, q.z); }

static void print_frame_rows(FILE *out, const RecordedRun *run, int64_t frame)
{
    RecordedFrame at = recorded_run_frame(run, frame);
    int64_t step = run->frame_step[frame];
    for (int i = 0; i < at.node_count; i++) {
        fprintf(out, "%.9g,%" PRId64 ",%d,", run->time_s[step], step, i);
        print_place(out, at.position[i], at.quaternion[i]);
        fputc('\n', out);
    }
}

// With several tools, the nodes of all of them, as in the final state that `run` writes.
static void print_tool_rows(FILE *out, const RecordedRun *run, int64_t frame)
{
    int64_t step = run->frame_step[frame];
    for (int k = 0; k < run->tool_count; k++) {
        const RecordedToolFrame at = recorded_run_tool_frame(run, k, frame);
        for (int i = 0; i < at.node_count; i++) {
            fprintf(out, "%.9g,%" PRId64 ",%s,%d,", run->time_s[step], step, run->tool[k].name, i);
            print_place(out, at.position[i], at.quaternion[i]);
            fprintf(out, ",%s", at.carrier[i] < 0 ? "-" : run->tool[at.carrier[i]].name);
            if (run->exchange)
                fprintf(out, ",%d", recorded_run_fitted(run, k, step));
            fputc('\n', out);
        }
    }
}

bool recording_export_rows(const RecordedRun *run, const char *path, Faults *faults)
{
    OutputText text;
    bool several = run->tool_count > 1;
    if (!output_text_open(&text)) {
        faults_add(faults, path, 0, 0, "cannot be written: out of memory");
        return false;
    }
    fprintf(text.stream, "t_s,step,%snode,x_mm,y_mm,z_mm,qw,qx,qy,qz%s%s\n", several ? "tool," : "", several ? ",carrier" : "",
            run->exchange ? ",exchange" : "");
    for (int64_t k = 0; k < run->frame_count; k++)
        (several ? print_tool_rows : print_frame_rows)(text.stream, run, k);
    return output_text_write(&text, path, faults);
}

// A polyline of a frame: that of the single tool, or of one of several tools with all its own nodes.
typedef struct FrameLine {
    int count;
    const Vec3 *position;
    const double *radius;
    const int8_t *carrier;   // NULL: a single tool
} FrameLine;

static int lines_of(const RecordedRun *run, int64_t frame, FrameLine line[STEP_TOOLS_MAX])
{
    RecordedFrame at = recorded_run_frame(run, frame);
    line[0] = (FrameLine){at.node_count, at.position, at.radius, NULL};
    for (int k = 0; run->tool_count > 1 && k < run->tool_count; k++) {
        const RecordedToolFrame own = recorded_run_tool_frame(run, k, frame);
        line[k] = (FrameLine){own.node_count, own.position, own.radius, own.carrier};
    }
    return run->tool_count;
}

static void print_tool_numbers(FILE *out, const FrameLine *line, int lines)
{
    vtp_array(out, "Int32", "tool", 1);
    for (int k = 0; k < lines; k++)
        for (int i = 0; i < line[k].count; i++)
            fprintf(out, "%d\n", k);
    vtp_array_end(out);
    vtp_array(out, "Int32", "carrier", 1);
    for (int k = 0; k < lines; k++)
        for (int i = 0; i < line[k].count; i++)
            fprintf(out, "%d\n", line[k].carrier[i]);
    vtp_array_end(out);
}

static void print_frame_vtp(FILE *out, const RecordedRun *run, int64_t frame)
{
    FrameLine line[STEP_TOOLS_MAX];
    int lines = lines_of(run, frame, line), points = 0, end = 0;
    for (int k = 0; k < lines; k++)
        points += line[k].count;
    vtp_begin(out, points, lines, 0);
    fprintf(out, "<PointData Scalars=\"Radius\">\n");
    vtp_array(out, "Float64", "Radius", 1);
    for (int k = 0; k < lines; k++)
        for (int i = 0; i < line[k].count; i++)
            fprintf(out, "%.9g\n", line[k].radius[i]);
    vtp_array_end(out);
    if (line[0].carrier)
        print_tool_numbers(out, line, lines);
    fprintf(out, "</PointData>\n<Points>\n");
    vtp_array(out, "Float64", "Points", 3);
    for (int k = 0; k < lines; k++)
        for (int i = 0; i < line[k].count; i++)
            fprintf(out, "%.9g %.9g %.9g\n", line[k].position[i].x, line[k].position[i].y, line[k].position[i].z);
    vtp_array_end(out);
    fprintf(out, "</Points>\n<Lines>\n");
    vtp_array(out, "Int64", "connectivity", 1);
    for (int i = 0; i < points; i++)
        fprintf(out, "%d\n", i);
    vtp_array_end(out);
    vtp_array(out, "Int64", "offsets", 1);
    for (int k = 0; k < lines; k++)
        fprintf(out, "%d\n", end += line[k].count);
    vtp_array_end(out);
    fprintf(out, "</Lines>\n");
    vtp_end(out);
}

static bool export_frame(const char *path, const RecordedRun *run, int64_t frame, Faults *faults)
{
    OutputText text;
    if (!output_text_open(&text)) {
        faults_add(faults, path, 0, 0, "cannot be written: out of memory");
        return false;
    }
    print_frame_vtp(text.stream, run, frame);
    return output_text_write(&text, path, faults);
}

// OUT.pvd lists OUT_00000.vtp and the following with their times; it is written last, so the files that it lists exist.
bool recording_export_series(const RecordedRun *run, const char *path, Faults *faults)
{
    int stem = (int)(strlen(path) - 4);
    size_t capacity = strlen(path) + 32;
    char *file = malloc(capacity);
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    OutputText list;
    bool good = file && output_text_open(&list);
    if (!good) {
        faults_add(faults, path, 0, 0, "cannot be written: out of memory");
        free(file);
        return false;
    }
    fprintf(list.stream, "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n<Collection>\n");
    for (int64_t k = 0; good && k < run->frame_count; k++) {
        snprintf(file, capacity, "%.*s_%05" PRId64 ".vtp", stem, path, k);
        good = export_frame(file, run, k, faults);
        fprintf(list.stream, "<DataSet timestep=\"%.9g\" group=\"\" part=\"0\" file=\"%.*s_%05" PRId64 ".vtp\"/>\n", run->time_s[run->frame_step[k]],
                stem - (int)(name - path), name, k);
    }
    fprintf(list.stream, "</Collection>\n</VTKFile>\n");
    snprintf(file, capacity, "%.*s.pvd", stem, path);
    if (good) {
        good = output_text_write(&list, file, faults);
    } else {
        fclose(list.stream);
        free(list.bytes);
    }
    free(file);
    return good;
}
