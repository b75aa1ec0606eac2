#include "sim/run_summary.h"

#include "base/base.h"

#include <cJSON.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

// A tool deeper in the wall than this has left the vessel. (Leaving through an open end is reported but is not a failure.)
static const double lost_mm = 1;

// Distance of the last state's deepest node outside the wall [mm], from a node report.
static double run_final_penetration_mm(const NodeReport *node, int node_count)
{
    double deepest = 0;
    for (int i = 0; i < node_count; i++)
        deepest = fmax(deepest, -node[i].gap);
    return deepest;
}

bool run_left_vessel(const RunTotals *totals) { return totals->penetration_max > lost_mm; }

static void add_numbers(cJSON *object, int count, const char *const *name, const double *value)
{
    for (int i = 0; i < count; i++)
        cJSON_AddNumberToObject(object, name[i], value[i]);
}

static void add_vector(cJSON *object, const char *name, Vec3 v)
{
    double value[3] = {v.x, v.y, v.z};
    cJSON_AddItemToObject(object, name, cJSON_CreateDoubleArray(value, 3));
}

static void add_times(cJSON *summary, const StepProfile *profile)
{
    static const char *const names[] = {"median", "p99", "p999", "max"};
    static const struct {
        const char *name;
        double share;
    } spread[] = {{"stage_us", 0.5}, {"stage_p99_us", 0.99}, {"stage_p999_us", 0.999}};
    cJSON *step = cJSON_AddObjectToObject(summary, "step_us");
    double value[4] = {histogram_quantile(&profile->step, 0.5) / 1000, histogram_quantile(&profile->step, 0.99) / 1000,
                       histogram_quantile(&profile->step, 0.999) / 1000, (double)profile->step.largest / 1000};
    add_numbers(step, 4, names, value);
    for (size_t k = 0; k < sizeof spread / sizeof *spread; k++) {
        cJSON *stages = cJSON_AddObjectToObject(summary, spread[k].name);
        for (int i = 0; i < STAGE_COUNT; i++)
            cJSON_AddNumberToObject(stages, stage_name[i], histogram_quantile(&profile->stage[i], spread[k].share) / 1000);
    }
}

static const char *const energy_name[] = {
    "hand", "load", "elastic", "kinetic", "friction", "damping", "numerical", "wall", "work", "gained", "gained_most_in_a_step", "gained_most_at_s"};

static void add_energy(cJSON *summary, const EnergyBalance *e)
{
    cJSON *energy = cJSON_AddObjectToObject(summary, "energy_mj");
    double value[] = {e->hand,      e->load, e->elastic, e->kinetic, e->friction,    e->damping,
                      e->numerical, e->wall, e->work,    e->gained,  e->gained_most, e->gained_at_s};
    add_numbers(energy, (int)(sizeof value / sizeof *value), energy_name, value);
}

// For several tools: the reaction at each hub and the position of each tip.
static void add_tools(cJSON *summary, Simulator *simulator)
{
    const Scene *scene = simulator_scene(simulator);
    Stepper *stepper = simulator_stepper(simulator);
    const StepReport *last = simulator_last(simulator);
    cJSON *tools = cJSON_AddArrayToObject(summary, "tools");
    for (int k = 0; k < scene->tool_count; k++) {
        int count = stepper_tool_nodes(stepper, k, NULL);
        ToolNode *node = HEAP_ZEROED((size_t)count, sizeof *node);
        stepper_tool_nodes(stepper, k, node);
        cJSON *tool = cJSON_CreateObject(), *proximal;
        cJSON_AddStringToObject(tool, "name", scene->tool[k].name);
        proximal = cJSON_AddObjectToObject(tool, "proximal");
        add_numbers(proximal, 2, (const char *const[]){"force_n", "torque_n_mm"}, (double[]){last->push[k], last->torque[k]});
        add_vector(tool, "tip_mm", node[count - 1].position);
        cJSON_AddNumberToObject(tool, "inserted_mm", stepper_tool_inserted(stepper, k));
        if (scene_device_count(scene, k) > 1)
            cJSON_AddNumberToObject(tool, "exchange", stepper_fitted(stepper, k));
        cJSON_AddItemToArray(tools, tool);
        free(node);
    }
}

static void add_targets(cJSON *summary, const Simulator *simulator)
{
    const Scene *scene = simulator_scene(simulator);
    const TargetReach *reach = simulator_targets(simulator);
    cJSON *targets = cJSON_AddArrayToObject(summary, "targets");
    for (int i = 0; i < scene->target_count; i++) {
        cJSON *target = cJSON_CreateObject();
        cJSON_AddStringToObject(target, "name", scene->target[i].name);
        cJSON_AddBoolToObject(target, "reached", reach[i].reached);
        cJSON_AddNumberToObject(target, "distance_mm", reach[i].distance);
        cJSON_AddNumberToObject(target, "time_s", reach[i].time_s);
        const WireState *state = simulator_state(simulator);
        cJSON_AddNumberToObject(target, "final_distance_mm", vec3_distance(state->position[state->node_count - 1], scene->target[i].point));
        cJSON_AddItemToArray(targets, target);
    }
}

static void add_flags(cJSON *summary, const Simulator *simulator, const DriveReport *drive)
{
    unsigned flags = simulator_totals(simulator)->flags;
    cJSON *list = cJSON_AddArrayToObject(summary, "flags");
    for (int i = 0; i < STEP_FLAG_COUNT; i++)
        if (flags & 1u << i)
            cJSON_AddItemToArray(list, cJSON_CreateString(step_flag_name[i]));
    if (simulator_gains_energy(simulator))
        cJSON_AddItemToArray(list, cJSON_CreateString("gains_energy"));
    if (drive->end == DRIVE_STOPPED)
        cJSON_AddItemToArray(list, cJSON_CreateString("stopped"));
}

char *run_summary_json(Simulator *simulator, const DriveReport *drive, const NodeReport *node)
{
    const RunTotals *totals = simulator_totals(simulator);
    const StepReport *last = simulator_last(simulator);
    const StepProfile *profile = simulator_profile(simulator);
    const WireState *state = simulator_state(simulator);
    cJSON *summary = cJSON_CreateObject(), *part;
    double simulated = simulator_time_s(simulator);
    char hash[17];
    cJSON_AddNumberToObject(summary, "steps", (double)totals->steps);
    cJSON_AddNumberToObject(summary, "simulated_s", simulated);
    cJSON_AddNumberToObject(summary, "wall_s", drive->wall_s);
    cJSON_AddNumberToObject(summary, "real_time_factor", drive->wall_s > 0 ? simulated / drive->wall_s : 0);
    add_times(summary, profile);
    cJSON_AddNumberToObject(summary, "deadline_misses", (double)drive->deadline_misses);
    cJSON_AddNumberToObject(summary, "slowed_s", drive->slowed_s);
    cJSON_AddNumberToObject(summary, "worst_miss_ms", drive->latest_s * 1000);
    cJSON_AddBoolToObject(summary, "real_time_priority", drive->real_time_priority);
    part = cJSON_AddObjectToObject(summary, "contacts");
    add_numbers(part, 2, (const char *const[]){"max", "final"}, (double[]){totals->contacts_max, last->active});
    part = cJSON_AddObjectToObject(summary, "self_contacts");
    add_numbers(part, 3, (const char *const[]){"max", "final", "overlap_max_mm"},
                (double[]){totals->self_contacts_max, last->self_contacts, totals->self_overlap_max});
    part = cJSON_AddObjectToObject(summary, "penetration_mm");
    double final = run_final_penetration_mm(node, state->node_count);
    add_numbers(part, 2, (const char *const[]){"max", "final"}, (double[]){fmax(totals->penetration_max, final), final});
    part = cJSON_AddObjectToObject(summary, "solver");
    add_numbers(part, 7,
                (const char *const[]){"iterations_median", "iterations_max", "not_converged_steps", "residual_max", "linearised_again_steps", "limited_steps",
                                      "model_disagrees_steps"},
                (double[]){histogram_quantile(&profile->iterations, 0.5), (double)profile->iterations.largest, (double)totals->not_converged_steps,
                           totals->residual_max, (double)totals->further_linearisations, (double)totals->limited_steps, (double)totals->disagreeing_steps});
    part = cJSON_AddObjectToObject(summary, "exchanges");
    add_numbers(part, 2, (const char *const[]){"done", "refused"}, (double[]){(double)totals->exchanges, (double)totals->refused_exchanges});
    part = cJSON_AddObjectToObject(summary, "proximal");
    add_numbers(
        part, 6, (const char *const[]){"force_n", "torque_n_mm", "force_least_n", "force_most_n", "slip_steps", "slipped_mm"},
        (double[]){last->proximal_force, last->proximal_torque, totals->push_least, totals->push_most, (double)totals->hand_slip_steps, totals->hand_slipped});
    part = cJSON_AddObjectToObject(summary, "wall_force_n");
    add_numbers(part, 2, (const char *const[]){"max", "sum_final"}, (double[]){last->wall_force_max, last->wall_force_sum});
    add_vector(summary, "tip_mm", state->position[state->node_count - 1]);
    cJSON_AddNumberToObject(summary, "inserted_mm", state->inserted);
    cJSON_AddNumberToObject(summary, "elastic_energy_mj", stepper_elastic_energy(simulator_stepper(simulator)));
    if (simulator_energy(simulator)->watched)
        add_energy(summary, simulator_energy(simulator));
    cJSON_AddBoolToObject(summary, "settled", drive->settled);
    snprintf(hash, sizeof hash, "%016" PRIx64, simulator_hash(simulator));
    cJSON_AddStringToObject(summary, "state_hash", hash);
    if (simulator_scene(simulator)->tool_count > 1)
        add_tools(summary, simulator);
    add_flags(summary, simulator, drive);
    add_targets(summary, simulator);
    char *text = cJSON_Print(summary);
    cJSON_Delete(summary);
    return text;
}

// With several tools, the own nodes of every tool, at their positions on the shared centreline; the wall's effects are given at the chain's nodes, for the
// carriers.
static bool write_tools(FILE *stream, Simulator *simulator, const NodeReport *node)
{
    const Scene *scene = simulator_scene(simulator);
    Stepper *stepper = simulator_stepper(simulator);
    const WireState *state = simulator_state(simulator);
    fprintf(stream, "tool,node,s_mm,x_mm,y_mm,z_mm,qw,qx,qy,qz,force_x_n,force_y_n,force_z_n,gap_mm,vessel_node,carrier\n");
    for (int k = 0; k < scene->tool_count; k++) {
        int count = stepper_tool_nodes(stepper, k, NULL);
        ToolNode *own = calloc((size_t)count, sizeof *own);
        if (!own)
            return false;
        stepper_tool_nodes(stepper, k, own);
        for (int i = 0; i < count; i++) {
            NodeReport wall = {.gap = HUGE_VAL, .vessel_node = -1};
            for (int c = 0; own[i].carrier == k && c < state->node_count; c++)
                if (vec3_distance(state->position[c], own[i].position) < 1e-9)
                    wall = node[c];
            Quat q = own[i].orientation;
            Vec3 x = own[i].position, f = wall.force;
            fprintf(stream, "%s,%d,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%d,%s\n", scene->tool[k].name, i, own[i].s, x.x, x.y,
                    x.z, q.w, q.x, q.y, q.z, f.x, f.y, f.z, wall.gap, wall.vessel_node, own[i].carrier < 0 ? "-" : scene->tool[own[i].carrier].name);
        }
        free(own);
    }
    return true;
}

// Text of the final state, one row per node.
static char *run_final_csv(Simulator *simulator, const NodeReport *node, size_t *length)
{
    const WireState *state = simulator_state(simulator);
    char *text = NULL;
    FILE *stream = open_memstream(&text, length);
    if (!stream)
        return NULL;
    if (simulator_scene(simulator)->tool_count > 1) {
        bool whole = write_tools(stream, simulator, node);
        if (fclose(stream) == 0 && whole)
            return text;
        free(text);
        return NULL;
    }
    fprintf(stream, "node,s_mm,x_mm,y_mm,z_mm,qw,qx,qy,qz,force_x_n,force_y_n,force_z_n,gap_mm,vessel_node\n");
    for (int i = 0; i < state->node_count; i++) {
        Vec3 x = state->position[i], force = node[i].force;
        Quat q = state->orientation[i];
        fprintf(stream, "%d,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%d\n", i, node[i].s, x.x, x.y, x.z, q.w, q.x, q.y, q.z,
                force.x, force.y, force.z, node[i].gap, node[i].vessel_node);
    }
    if (fclose(stream) != 0) {
        free(text);
        return NULL;
    }
    return text;
}

void run_print(FILE *out, Simulator *simulator, const DriveReport *drive, const NodeReport *node)
{
    const RunTotals *totals = simulator_totals(simulator);
    const StepReport *last = simulator_last(simulator);
    const StepProfile *profile = simulator_profile(simulator);
    const WireState *state = simulator_state(simulator);
    const Scene *scene = simulator_scene(simulator);
    const TargetReach *reach = simulator_targets(simulator);
    Vec3 tip = state->position[state->node_count - 1];
    double simulated = simulator_time_s(simulator);
    fprintf(out, "%s: %.3f s simulated in %.3f s (%.2f times real time), %" PRId64 " steps%s\n", scene->path, simulated, drive->wall_s,
            drive->wall_s > 0 ? simulated / drive->wall_s : 0, totals->steps, drive->end == DRIVE_STOPPED ? ", stopped" : "");
    fprintf(out, "step %.0f us median, %.0f us p99.9, %.0f us max; contact %.0f iterations median, %" PRId64 " max, residual at most %.1e\n",
            histogram_quantile(&profile->step, 0.5) / 1000, histogram_quantile(&profile->step, 0.999) / 1000, (double)profile->step.largest / 1000,
            histogram_quantile(&profile->iterations, 0.5), profile->iterations.largest, totals->residual_max);
    fprintf(out, "tip at (%.3f, %.3f, %.3f) mm, %.2f mm inserted%s; push %.4f N (from %.4f to %.4f), torque %.4f N mm\n", tip.x, tip.y, tip.z, state->inserted,
            drive->settled ? ", at rest" : "", last->proximal_force, totals->push_least, totals->push_most, last->proximal_torque);
    for (int k = 0; scene->tool_count > 1 && k < scene->tool_count; k++)
        fprintf(out, "tool %s: %.2f mm inserted, push %.4f N, torque %.4f N mm\n", scene->tool[k].name, stepper_tool_inserted(simulator_stepper(simulator), k),
                last->push[k], last->torque[k]);
    fprintf(out, "%d contacts (at most %d), wall force %.4f N in sum; deepest penetration %.4f mm, %.4f mm at the end\n", last->active, totals->contacts_max,
            last->wall_force_sum, totals->penetration_max, run_final_penetration_mm(node, state->node_count));
    if (totals->self_contacts_max)
        fprintf(out, "the tool touches itself at %d places (at most %d), %.4f mm deep at most\n", last->self_contacts, totals->self_contacts_max,
                totals->self_overlap_max);
    fprintf(out, "%" PRId64 " steps took a further linearisation, %" PRId64 " were cut short and completed by later steps, %" PRId64 " did not converge\n",
            totals->further_linearisations, totals->limited_steps, totals->not_converged_steps);
    if (totals->hand_slip_steps)
        fprintf(out, "the hand slipped in %" PRId64 " steps, %.2f mm along the tool: it holds no more than %g N\n", totals->hand_slip_steps,
                totals->hand_slipped, scene->wire.hand_limit);
    if (totals->exchanges)
        fprintf(out, "%" PRId64 " tools were exchanged\n", totals->exchanges);
    if (totals->refused_exchanges)
        fprintf(out, "%" PRId64 " exchanges were refused, the last because %s\n", totals->refused_exchanges, step_exchange_refusal(totals->refusal));
    const EnergyBalance *e = simulator_energy(simulator);
    if (e->watched)
        fprintf(
            out,
            "energy [mJ]: hand %.4g, loads %.4g = elastic %.4g, kinetic %.2g, friction %.4g, damping %.4g, numerical %.4g (the wall gave %.3g); single steps "
            "gained %.2g, at most %.2g at %.3f s\n",
            e->hand, e->load, e->elastic, e->kinetic, e->friction, e->damping, e->numerical, e->wall, e->gained, e->gained_most, e->gained_at_s);
    if (drive->deadline_misses)
        fprintf(out, "SLOWED: %" PRId64 " deadlines missed, the worst by %.2f ms; simulated time fell %.3f s behind real time\n", drive->deadline_misses,
                drive->latest_s * 1000, drive->slowed_s);
    for (int i = 0; i < scene->target_count; i++)
        fprintf(out, "target %s: %s, nearest %.2f mm (radius %.2f), at %.3f s\n", scene->target[i].name, reach[i].reached ? "reached" : "NOT reached",
                reach[i].distance, scene->target[i].radius, reach[i].time_s);
}

// A run with a node further outside the wall than this gets a warning.
static const double deep_mm = 0.2;

void run_print_warnings(FILE *out, const Simulator *simulator, const DriveReport *drive)
{
    const RunTotals *totals = simulator_totals(simulator);
    const char *path = simulator_scene(simulator)->path;
    if (drive->end == DRIVE_DIVERGED)
        fprintf(out, "%s: diverged at %.3f s; the last good state is kept. Smaller step_ms, shorter elements or slower motion may help\n", path,
                simulator_time_s(simulator));
    if (run_left_vessel(totals))
        fprintf(out, "%s: the tool left the vessel (deepest %.3f mm outside the wall); the run cannot be trusted\n", path, totals->penetration_max);
    else if (totals->penetration_max > deep_mm)
        fprintf(out, "%s: warning: a node was %.3f mm outside the wall\n", path, totals->penetration_max);
    if (totals->flags & STEP_OUT_OF_VESSEL)
        fprintf(out, "%s: warning: the tool passed an open end of the vessel\n", path);
    if (totals->disagreeing_steps > 0)
        fprintf(out,
                "%s: warning: in %lld of %lld steps two parts of the vessel's model put the wall at different places; "
                "fit the model again with this version\n",
                path, (long long)totals->disagreeing_steps, (long long)totals->steps);
    const EnergyBalance *energy = simulator_energy(simulator);
    if (simulator_gains_energy(simulator))
        fprintf(out, "%s: warning: single steps gained %.3g mJ of energy without a source, of %.4g mJ of work (most: %.3g mJ at %.3f s)\n", path,
                energy->gained, energy->work, energy->gained_most, energy->gained_at_s);
    if (totals->not_converged_steps > 0)
        fprintf(out, "%s: warning: the contact solve of %lld of %lld steps stopped at its limit of iterations (residual at most %.2g)\n", path,
                (long long)totals->not_converged_steps, (long long)totals->steps, totals->residual_max);
}

bool run_write_summary(const char *path, Simulator *simulator, const DriveReport *drive, const NodeReport *node, Faults *faults)
{
    return output_write_line(path, run_summary_json(simulator, drive, node), faults);
}

bool run_write_final(const char *path, Simulator *simulator, const NodeReport *node, Faults *faults)
{
    size_t length;
    char *text = run_final_csv(simulator, node, &length);
    if (!text)
        faults_add(faults, path, 0, 0, "cannot be written: out of memory");
    bool good = text && output_write(path, text, length, faults);
    free(text);
    return good;
}
