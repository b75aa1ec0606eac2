// sim: builds a simulator from a scene, drives it by input, records and compares runs. Uses base, geom, solver, recon and input.
// Reading order: scene.h (what is simulated), open_vessel.h (the wall), simulator.h (one step), drive.h (many steps), recording.h, compare.h; for input by
// hand: hand_set.h, realtime.h.
#ifndef SELDINGER_SIM_SIM_H
#define SELDINGER_SIM_SIM_H

// scenes
#include "sim/scene.h"
#include "sim/scene_list.h"
#include "sim/patient_landmarks.h"
#include "sim/open_vessel.h"
#include "sim/vessel_cache.h"
#include "sim/surface_cache.h"
#include "sim/case_acts.h"
#include "sim/case_builder.h"
#include "sim/case_make.h"
#include "sim/tray_devices.h"
#include "sim/tube_tree.h"

// runs
#include "sim/simulator.h"
#include "sim/drive.h"
#include "sim/headless.h"
#include "sim/pose.h"
#include "sim/run_summary.h"
#include "sim/compare.h"
#include "sim/golden.h"
#include "sim/baseline.h"
#include "sim/check_case.h"
#include "sim/first_order.h"
#include "sim/sweep_results.h"
#include "sim/verify_run.h"

// hands in real time
#include "sim/clock.h"
#include "sim/hand_grip.h"
#include "sim/hand_set.h"
#include "sim/realtime.h"
#include "sim/live_session.h"

// recordings
#include "sim/recording.h"
#include "sim/recording_export.h"
#include "sim/describe_run.h"
#include "sim/moments.h"
#include "sim/recover.h"
#include "sim/replay_again.h"

// sessions
#include "sim/contrast_injection.h"
#include "sim/rescore.h"
#include "sim/run_marks.h"
#include "sim/score.h"
#include "sim/score_json.h"
#include "sim/score_points.h"
#include "sim/session.h"
#include "sim/session_archive.h"
#include "sim/session_files.h"
#include "sim/shelf.h"
#include "sim/xray.h"
#include "sim/xray_tube.h"
#include "sim/c_arm.h"
#include "sim/xray_image.h"

#endif
