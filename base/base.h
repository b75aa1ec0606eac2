// base: what every folder needs and the C library does not provide. Faults, assertions, memory, files that are read or written completely or not at all, YAML,
// tables of numbers, command-line options, signals and exit codes, parallel loops, instruction sets, and elementary functions with bit-identical results.
// Uses no other folder. Read faults.h and assert.h first (all others use them), then whatever you need.
#ifndef SELDINGER_BASE_BASE_H
#define SELDINGER_BASE_BASE_H

// faults and assumptions
#include "base/assert.h"
#include "base/faults.h"
#include "base/folders.h"
#include "base/nearest_name.h"

// memory and order
#include "base/disjoint_sets.h"
#include "base/heap.h"
#include "base/sort_doubles.h"

// threads and instruction sets
#include "base/atomic.h"
#include "base/parallel.h"
#include "base/simd.h"
#include "base/simd_kernel.h"

// numbers
#include "base/content_digest.h"
#include "base/same_math.h"
#include "base/sha256.h"

// files
#include "base/number_table.h"
#include "base/output.h"
#include "base/part_file.h"
#include "base/path_resolve.h"
#include "base/plain_json.h"
#include "base/regular_file.h"
#include "base/text_file.h"
#include "base/whole_file.h"
#include "base/yaml_edit.h"
#include "base/yaml_reader.h"

// programs
#include "base/option_table.h"
#include "base/options.h"
#include "base/options_manual.h"
#include "base/process.h"
#include "base/progress_bar.h"

#endif
