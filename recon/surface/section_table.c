#include "recon/surface/section_table.h"

bool section_table_write(const char *path, const SweepModel *model, Faults *faults)
{
    OutputText text;
    SweepField *field = sweep_field_create(model);
    if (!field || !output_text_open(&text)) {
        faults_add(faults, path, 0, 0, "cannot be written: out of memory");
        sweep_field_free(field);
        return false;
    }
    fprintf(text.stream, "branch,t_mm,x_mm,y_mm,z_mm,nx,ny,nz,area_mm2,mean_radius_mm,least_radius_mm,largest_radius_mm,perimeter_mm,circularity,"
                         "least_diameter_mm,largest_diameter_mm,kind\n");
    for (int i = 0; i < model->branch_count; i++)
        for (int k = 0; k < model->branch[i].break_count; k++) {
            double t = fmin(model->break_t[model->branch[i].first_break + k], field->curve[i]->length);
            SweepSection s;
            bool has_contour = sweep_section_at(field, i, t, &s);
            fprintf(text.stream, "%d,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,", i, s.t, s.centre.x, s.centre.y, s.centre.z, s.normal.x, s.normal.y, s.normal.z);
            if (has_contour)
                fprintf(text.stream, "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%s\n", s.area, s.mean, s.least, s.largest, s.perimeter, s.circularity,
                        s.least_diameter, s.largest_diameter, section_kind_name[s.kind]);
            else
                fprintf(text.stream, ",,,,,,,,\n");
        }
    sweep_field_free(field);
    return output_text_write(&text, path, faults);
}

bool section_table_of_file(const char *path, const char *name, const ModelFile *file, Faults *faults)
{
    const SweepModel *model = file->sweep;
    for (int i = 0; i < SECTION_KINDS && !model; i++)
        model = file->swept.of[i];
    if (path && !model)
        faults_add(faults, name, 0, 0, "has no swept model, whose sections --sections writes; `seldinger fit --model sweep` makes one");
    return !path || (model && section_table_write(path, model, faults));
}
