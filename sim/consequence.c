#include "sim/consequence.h"

#include <math.h>

static const double MEAN_MS = 20;
static const double INNER_LAYERS = 0.5;      // of a perforation's force
static const double PEEL_N_MM = 0.035;
static const double SCRAPE_MM = 1;
static const double FORCED = 0.4, EASED = 0.5, EASED_MS = 500;   // part of a perforation's force that makes a spasm worse; of that, when an episode is over
static const double NARROWER = 0.1, NARROWEST = 0.5, SPASM = 0.25, RELAXED = 0.15;
static const double RELAX_MS = 180000, APART_MM = 20;
static const double AGAIN = 0.8;             // part of a limit below which another perforation or dissection may follow

ConsequenceRules consequence_rules_default(void)
{
    return (ConsequenceRules){.mode = CONSEQUENCES_IN_EXAMINATION,
                              .wall_strength_mpa = 1.2,
                              .sac_strength_mpa = 0.75,
                              .wall_to_radius = 0.1,
                              .sac_wall_mm = 0.2,
                              .clot_s = 600,
                              .points = {[CONSEQUENCE_PERFORATION] = 50, [CONSEQUENCE_DISSECTION] = 30, [CONSEQUENCE_SPASM] = 10, [CONSEQUENCE_CLOT] = 20}};
}

void consequence_rules_read(YamlValue value, ConsequenceRules *rules)
{
    static const char *const keys[] = {"wall_strength_mpa", "sac_strength_mpa", "wall_to_radius", "sac_wall_mm", "clot_s", "points", NULL};
    static const char *const kind[] = {"perforation", "dissection", "spasm", "clot", NULL};
    if (yaml_scalar(value)) {
        bool is_on = false;
        if (yaml_boolean(value, &is_on))
            rules->mode = is_on ? CONSEQUENCES_ON : CONSEQUENCES_OFF;
        return;
    }
    const NumberRange strength = {0.01, 100, false};
    YamlMap map = yaml_map(value, keys);
    rules->mode = CONSEQUENCES_ON;
    yaml_map_number(&map, "wall_strength_mpa", false, strength, &rules->wall_strength_mpa);
    yaml_map_number(&map, "sac_strength_mpa", false, strength, &rules->sac_strength_mpa);
    yaml_map_number(&map, "wall_to_radius", false, (NumberRange){0.001, 1, false}, &rules->wall_to_radius);
    yaml_map_number(&map, "sac_wall_mm", false, (NumberRange){0.001, 10, false}, &rules->sac_wall_mm);
    yaml_map_number(&map, "clot_s", false, (NumberRange){0, 86400, true}, &rules->clot_s);
    YamlMap points = yaml_map(yaml_get(&map, "points", false), kind);
    for (int i = 0; i < CONSEQUENCE_COUNT; i++)
        yaml_map_number(&points, kind[i], false, (NumberRange){0, 100, false}, &rules->points[i]);
}

double consequence_perforation_n(const ConsequenceRules *rules, ConsequenceWall wall, double diameter)
{
    double strength = wall.is_sac ? rules->sac_strength_mpa : rules->wall_strength_mpa;
    double thickness = wall.is_sac ? rules->sac_wall_mm : rules->wall_to_radius * wall.radius;
    return strength * PI * diameter * thickness;
}

double consequence_dissection_n(const ConsequenceRules *rules, ConsequenceWall wall, double diameter)
{
    return INNER_LAYERS * consequence_perforation_n(rules, wall, diameter) + PEEL_N_MM * diameter;
}

static void narrow(ConsequenceTip *tip, Vec3 at, double dt)
{
    const double force = vec3_norm(tip->press), limit = FORCED * tip->limit;
    tip->narrowed += tip->narrowed * same_expm1(-dt / RELAX_MS);
    if (tip->is_forced) {
        tip->eased = force < EASED * limit ? tip->eased + dt : 0;
        tip->is_forced = tip->eased < EASED_MS;
    } else if (force > limit) {
        if (vec3_distance(at, tip->forced_at) > APART_MM)
            tip->narrowed = 0;
        tip->narrowed = fmin(tip->narrowed + NARROWER, NARROWEST);
        tip->is_forced = true;
        tip->eased = 0;
        tip->forced_at = at;
    }
}

void consequence_tip_step(ConsequenceTip *tip, const ConsequenceRules *rules, ConsequenceWall wall, double diameter, ToolPlace end, Vec3 force, double dt)
{
    tip->press = vec3_add(tip->press, vec3_scale(vec3_sub(force, tip->press), -same_expm1(-dt / MEAN_MS)));
    tip->along = -vec3_dot(tip->press, end.along);
    tip->across = vec3_norm(vec3_add(tip->press, vec3_scale(end.along, tip->along)));
    tip->limit = consequence_perforation_n(rules, wall, diameter);
    tip->dissection_limit = consequence_dissection_n(rules, wall, diameter);
    const double force_now = vec3_norm(tip->press), slid = fmax(vec3_dot(end.velocity, end.along), 0) * dt;
    if (force_now > tip->dissection_limit && tip->across > tip->along)
        tip->scraped += slid;
    else if (force_now < AGAIN * tip->dissection_limit)
        tip->scraped = 0;
    narrow(tip, end.position, dt);
}

bool consequence_perforates(const ConsequenceTip *tip) { return tip->along > tip->limit && tip->along >= tip->across; }
bool consequence_dissects(const ConsequenceTip *tip) { return tip->scraped >= SCRAPE_MM; }
bool consequence_is_spasm(const ConsequenceTip *tip) { return tip->narrowed > SPASM; }
bool consequence_has_eased(const ConsequenceTip *tip) { return tip->along < AGAIN * tip->limit && tip->scraped <= 0; }
bool consequence_has_relaxed(const ConsequenceTip *tip) { return tip->narrowed < RELAXED; }
