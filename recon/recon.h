// recon: builds a model of the vessels from an angiogram or a surface. Uses base and geom. Lengths are in mm, in the frame of the image.
// Reading order: volume/volume.h, track/rbt_track.h (image to tree), fit/field_fit.h and fit/lim_fit.h (tree to model), tree_file.h (files of trees and
// models).
#ifndef SELDINGER_RECON_RECON_H
#define SELDINGER_RECON_RECON_H

// images
#include "recon/volume/volume.h"
#include "recon/volume/ct_soft_tissue.h"
#include "recon/volume/volume_file.h"
#include "recon/volume/volume_reduce.h"

// RANSAC-based tracking
#include "recon/track/rbt_watch.h"
#include "recon/track/trace.h"
#include "recon/track/rbt_parameters.h"
#include "recon/track/segment_parameters.h"
#include "recon/track/rbt_track.h"
#include "recon/track/segment_report.h"

// models
#include "recon/fit/field_fit.h"
#include "recon/fit/lim_fit.h"
#include "recon/fit/sweep_fit.h"
#include "recon/fit/tree_fit.h"
#include "recon/fit/fit_figures.h"
#include "recon/fit/measure_report.h"
#include "recon/fit/reach_report.h"

// edits of swept models
#include "recon/edit/edit_list.h"
#include "recon/edit/sweep_edit.h"
#include "recon/edit/edit_file.h"

// surfaces and centrelines
#include "recon/surface/centreline_file.h"
#include "recon/surface/centreline_write.h"
#include "recon/surface/import_figures.h"
#include "recon/surface/import_surface.h"
#include "recon/surface/mesh_centreline.h"
#include "recon/surface/mesh_check.h"
#include "recon/surface/mesh_pack.h"
#include "recon/surface/model_mask.h"
#include "recon/surface/model_surface.h"
#include "recon/surface/section_table.h"
#include "recon/surface/surface_file.h"
#include "recon/surface/vtp_write.h"

// synthetic shapes whose geometry is known exactly
#include "recon/phantom/phantom.h"
#include "recon/phantom/phantom_report.h"
#include "recon/phantom/phantom_write.h"

// files of trees and models
#include "recon/describe.h"
#include "recon/hdf5_reader.h"
#include "recon/hdf5_silence.h"
#include "recon/model_file.h"
#include "recon/sweep_file.h"
#include "recon/tree_file.h"

#endif
