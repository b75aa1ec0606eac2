// Seldinger as a library: guide wires and catheters in blood vessels. Read in this order: base.h (results, contexts, memory), scene.h (what is simulated),
// simulator.h (a step, poses, forces, score, recording), batch.h (many at once), recording.h (replay), recon.h (from an angiogram to a vessel). docs/library.md shows two programs.
#ifndef SELDINGER_PUBLIC_SELDINGER_H
#define SELDINGER_PUBLIC_SELDINGER_H

#include "base.h"
#include "batch.h"
#include "recon.h"
#include "recording.h"
#include "scene.h"
#include "simulator.h"

#endif
