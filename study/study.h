// study: many runs of a scene with other values (`seldinger sweep`): a specification, its runs on threads or MPI ranks, a journal of results that survives a
// kill, and the table made from it. Uses base, geom, input, recon and sim.
// Reading order: spec.h (what is varied), points.h (the values of run K), one_run.h (run K), journal.h (what is kept), queue.h (who runs what),
// workers.h and ranks.h (threads, MPI), table.h (the result).
#ifndef SELDINGER_STUDY_STUDY_H
#define SELDINGER_STUDY_STUDY_H

#include "study/spec.h"
#include "study/points.h"
#include "study/open_study.h"
#include "study/one_run.h"
#include "study/journal.h"
#include "study/queue.h"
#include "study/workers.h"
#include "study/ranks.h"
#include "study/sweep_work.h"
#include "study/table.h"
#include "study/queue_model.h"

#endif
