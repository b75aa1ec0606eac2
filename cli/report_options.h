// The options of `report`.
#ifndef SELDINGER_CLI_REPORT_OPTIONS_H
#define SELDINGER_CLI_REPORT_OPTIONS_H

#include "base/base.h"

typedef struct ReportOptions {
    const char *session, *html, *pdf, *with, *trainee, *csv;
    bool is_folder;          // `session` is a folder of sessions
    const char *recording;   // NULL if a session file was given
    bool quiet;
    char own_html[4096], own_folder[4096], beside[4096];
} ReportOptions;
extern const OptionTable report_options;

#endif
