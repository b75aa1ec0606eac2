// The files that `seldinger check` writes about its cases: JSON, JUnit XML, a page.
#ifndef SELDINGER_CLI_CHECK_FILES_H
#define SELDINGER_CLI_CHECK_FILES_H

#include "cli/output_plan.h"

typedef struct CheckFiles {
    const char *json, *junit, *page;     // NULL: not wanted
} CheckFiles;

void check_files_plan(const CheckFiles *files, OutputPlan *plan);
// False with faults.
bool check_files_write(const CheckFiles *files, const CheckLog *log, Faults *faults);

#endif
