#include "recon/fit/measure_report.h"

static void print_jumps(FILE *out, const char *what, const JumpRow *row)
{
    for (int place = 0; place < PLACES; place++)
        if (row[place].count > 0)
            fprintf(out, "%-8s %-12s %7d %9.4f %8.4f %8.4f %9.4f %8.4f %8.4f   %d, %d\n", what, model_place_name[place], row[place].count,
                    row[place].gap_median, row[place].gap_p99, row[place].gap_most, row[place].normal_median, row[place].normal_p99, row[place].normal_most,
                    row[place].worst_node, row[place].worst_other);
}

void model_measure_print(FILE *out, const ModelMeasure *m)
{
    fprintf(out, "jumps between  place          joins   gap p50      p99  max [mm] normal p50      p99 max [rad]   worst pair of nodes\n");
    print_jumps(out, "raw", m->raw);
    print_jumps(out, "as met", m->met);
    print_jumps(out, "cold", m->cold);
    fprintf(out, "bare walls     %d nodes with wall further than 0.6 r from data", m->bare_nodes);
    if (m->bare_nodes > 0)
        fprintf(out, ", at most %.3f mm (node %d)", m->bare_most_mm, m->bare_worst);
    fprintf(out, "\nghost sheets   %d nodes", m->ghost_nodes);
    if (m->ghost_nodes > 0)
        fprintf(out, ", at most %.3f mm from data (node %d)", m->ghost_most_mm, m->ghost_worst);
    fprintf(out, "\nnarrow links   %d of %d have less than half the radius free", m->narrow_links, m->links);
    if (m->links > 0)
        fprintf(out, "; least %.3f r (node %d)", m->least_clearance, m->narrowest_node);
    fprintf(out, "\n");
}

static void json_jumps(cJSON *root, const char *name, const JumpRow *row)
{
    cJSON *object = cJSON_AddObjectToObject(root, name);
    for (int place = 0; place < PLACES; place++) {
        cJSON *item = cJSON_AddObjectToObject(object, model_place_name[place]);
        cJSON_AddNumberToObject(item, "joins", row[place].count);
        cJSON_AddNumberToObject(item, "gap_p50_mm", row[place].gap_median);
        cJSON_AddNumberToObject(item, "gap_p99_mm", row[place].gap_p99);
        cJSON_AddNumberToObject(item, "gap_max_mm", row[place].gap_most);
        cJSON_AddNumberToObject(item, "normal_p50_rad", row[place].normal_median);
        cJSON_AddNumberToObject(item, "normal_p99_rad", row[place].normal_p99);
        cJSON_AddNumberToObject(item, "normal_max_rad", row[place].normal_most);
        cJSON_AddNumberToObject(item, "worst_node", row[place].worst_node);
        cJSON_AddNumberToObject(item, "worst_other", row[place].worst_other);
    }
}

void model_measure_add(cJSON *root, const ModelMeasure *m)
{
    json_jumps(root, "jumps_raw", m->raw);
    json_jumps(root, "jumps_as_met", m->met);
    json_jumps(root, "jumps_cold", m->cold);
    cJSON_AddNumberToObject(root, "bare_nodes", m->bare_nodes);
    cJSON_AddNumberToObject(root, "bare_max_mm", m->bare_most_mm);
    cJSON_AddNumberToObject(root, "bare_worst_node", m->bare_worst);
    cJSON_AddNumberToObject(root, "ghost_nodes", m->ghost_nodes);
    cJSON_AddNumberToObject(root, "ghost_max_mm", m->ghost_most_mm);
    cJSON_AddNumberToObject(root, "ghost_worst_node", m->ghost_worst);
    cJSON_AddNumberToObject(root, "narrow_links", m->narrow_links);
    cJSON_AddNumberToObject(root, "least_clearance_ratio", m->links > 0 ? m->least_clearance : 1);
    cJSON_AddNumberToObject(root, "narrowest_node", m->narrowest_node);
}
