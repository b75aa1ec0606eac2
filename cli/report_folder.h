// The pages and the table over all sessions of a folder.
#ifndef SELDINGER_CLI_REPORT_FOLDER_H
#define SELDINGER_CLI_REPORT_FOLDER_H

#include "cli/report_options.h"

// Returns false with faults.
bool report_of_folder(const ReportOptions *options, Faults *faults);
// Writes a page to options->html and options->pdf, where given; takes ownership of it. NULL: it could not be made, and its fault is known.
bool report_write(const ReportOptions *options, char *page, size_t length, Faults *faults);

#endif
