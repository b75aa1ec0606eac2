// A small exercise in a bent tube and a session of a hand, for the tests of recording and replay of sessions.
#ifndef SELDINGER_TESTS_TRAINER_SCENE_H
#define SELDINGER_TESTS_TRAINER_SCENE_H

#include "recon/fit/lim_fit.h"
#include "sim/open_vessel.h"
#include "sim/recording.h"
#include "sim/session_tracker.h"
#include "sim/tube_tree.h"

#include <string.h>

static const char trainer_text[] =
    "seldinger: 1\n"
    "wire: {elements: 12, sections: [{length_mm: 70, diameter_mm: 0.36, young_modulus_gpa: 20}]}\n"
    "vessel: {tube: {start_mm: [0, 0, 0], direction: [1, 0, 0], radius_mm: 1.5, path: [{line_mm: 10}, {arc: {radius_mm: 20, angle_deg: 50}}, {line_mm: 12}]}, "
    "contact: tube, friction: 0.05}\n"
    "sheath: {entry_mm: [0, 0, 0], direction: [1, 0, 0], inserted_mm: 4}\n"
    "targets: [{name: bend, point_mm: [22, 4, 0], radius_mm: 3}]\n"
    "exercise: {title: To the bend, target: bend, hold_s: 1.5}\n";

static Faults faults;

typedef struct TrainerScene {
    Scene *scene;
    OpenVessel open;
} TrainerScene;

// The exact tube, or the blobby model of it with its tree.
static inline TrainerScene trainer_scene_open(bool with_tree)
{
    TrainerScene it = {0};
    faults_clear(&faults);
    it.scene = scene_parse(trainer_text, strlen(trainer_text), "bend.yaml", &faults);
    if (!it.scene)
        fail_msg("%s", faults.text[0]);
    it.open.vessel = tube_vessel_create(&it.scene->tube, "bend.yaml", &faults);
    assert_non_null(it.open.vessel);
    if (!with_tree)
        return it;
    VesselTree *sampled = tube_tree(it.open.vessel, &it.scene->tube, "bend.yaml", &faults);
    assert_non_null(sampled);
    LimFitOptions options = lim_fit_default_options();
    options.threads = 1;
    it.open.tree = lim_fit(sampled, &options, NULL, &faults);
    vessel_tree_free(sampled);
    assert_non_null(it.open.tree);
    it.open.vessel->destroy(it.open.vessel);
    it.open.vessel = lim_vessel_create(it.open.tree);
    assert_non_null(it.open.vessel);
    return it;
}

static inline void trainer_scene_close(TrainerScene *it)
{
    open_vessel_close(&it->open);
    scene_free(it->scene);
    *it = (TrainerScene){0};
}

// Checks that the figures of two scores are bit-identical.
static inline void assert_same_figures(const ScoreFigures *a, const ScoreFigures *b)
{
#define SAME(field) assert_memory_equal(&a->field, &b->field, sizeof a->field)
    SAME(state), SAME(has_exercise), SAME(has_xray), SAME(points), SAME(part), SAME(start_s), SAME(time_s), SAME(fluoroscopy_s), SAME(pulses);
    SAME(dose_area_cm2), SAME(contrast_ml), SAME(path_mm), SAME(way_mm), SAME(remaining_mm), SAME(least_remaining_mm), SAME(efficiency);
    SAME(inserted_mm), SAME(withdrawn_mm), SAME(wall_force_peak_n), SAME(wall_impulse_n_s), SAME(tip_force_n), SAME(tip_force_peak_n), SAME(tool[0].lost_mm);
    SAME(tool[0].lost_limit_mm), SAME(tip_node), SAME(tool[0].off_way_mm), SAME(blind_mm), SAME(target_distance_mm), SAME(held_s), SAME(reached_s),
        SAME(error_total);
    SAME(has_consequences), SAME(narrowest), SAME(dwell_s), SAME(mark_count), SAME(mark), SAME(guide), SAME(hint), SAME(hint_value);
    for (int i = 0; i < ERROR_COUNT; i++)
        SAME(error[i].count), SAME(error[i].is_on), SAME(error[i].last_s);
#undef SAME
}

#endif
