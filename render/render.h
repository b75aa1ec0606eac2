// render: window, views, pictures, videos and pages of reports. Uses base, geom, recon, input and sim. Drawing needs OpenGL 3.3 through EGL.
#ifndef SELDINGER_RENDER_RENDER_H
#define SELDINGER_RENDER_RENDER_H

// pages
#include "render/archive_page.h"
#include "render/check_junit.h"
#include "render/check_page.h"
#include "render/page_pdf.h"
#include "render/session_report.h"
#include "render/sweep_page.h"
#include "render/tree_page.h"

// pictures and films
#include "render/film.h"
#include "render/picture.h"
#include "render/picture_model.h"
#include "render/picture_moments.h"
#include "render/run_chart.h"

// the window
#include "render/case_window.h"
#include "render/case_picture.h"
#include "render/edit_window.h"
#include "render/replay_window.h"
#include "render/settings_in_force.h"
#include "render/start_window.h"
#include "render/trainer.h"
#include "render/translation.h"
#include "render/trainer_figures.h"

#endif
