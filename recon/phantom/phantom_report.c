#include "recon/phantom/phantom_report.h"

static void print_row(FILE *out, const char *name, const MeasureRow *row)
{
    fprintf(out, "%-28s %8d %8.4f %8.4f %8.4f %8.4f %8.4f %8.4f\n", name, row->count, row->mean, row->rms, row->median, row->p90, row->p99, row->most);
}

static void json_row(cJSON *root, const char *name, const MeasureRow *row)
{
    cJSON *item = cJSON_AddObjectToObject(root, name);
    cJSON_AddNumberToObject(item, "count", row->count);
    cJSON_AddNumberToObject(item, "mean_mm", row->mean);
    cJSON_AddNumberToObject(item, "rms_mm", row->rms);
    cJSON_AddNumberToObject(item, "p50_mm", row->median);
    cJSON_AddNumberToObject(item, "p90_mm", row->p90);
    cJSON_AddNumberToObject(item, "p99_mm", row->p99);
    cJSON_AddNumberToObject(item, "max_mm", row->most);
}

void shape_measure_print(FILE *out, const ShapeMeasure *figures)
{
    fprintf(out, "%-28s %8s %8s %8s %8s %8s %8s %8s\n", "distance [mm]", "count", "mean", "rms", "p50", "p90", "p99", "max");
    print_row(out, "true surface to model", &figures->to_model);
    print_row(out, "model in its cell to truth", &figures->to_truth);
    print_row(out, "jump between neighbours", &figures->jump);
    fprintf(out, "bias %+.4f mm, least clearance at node centres %.3f of the true, worst node %d\n", figures->bias, figures->least_clearance,
            figures->worst_node);
}

void shape_measure_add(cJSON *root, const ShapeMeasure *figures)
{
    json_row(root, "truth_to_model", &figures->to_model);
    json_row(root, "model_to_truth", &figures->to_truth);
    json_row(root, "jump", &figures->jump);
    cJSON_AddNumberToObject(root, "bias_mm", figures->bias);
    cJSON_AddNumberToObject(root, "least_clearance_ratio", figures->least_clearance);
    cJSON_AddNumberToObject(root, "worst_node", figures->worst_node);
}
