#include "cli/report_folder.h"

#include "render/render.h"
#include "sim/sim.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool write_csv(const ReportOptions *options, const SessionArchive *archive, Faults *faults)
{
    OutputText text;
    if (!output_text_open(&text)) {
        faults_add(faults, options->csv, 0, 0, "out of memory for the table");
        return false;
    }
    session_archive_print_csv(archive, options->trainee, text.stream);
    return output_text_write(&text, options->csv, faults);
}

bool report_write(const ReportOptions *options, char *page, size_t length, Faults *faults)
{
    bool good = page && (!options->html || output_write(options->html, page, length, faults));
    good = good && (!options->pdf || page_write_pdf(options->pdf, page, length, faults));
    free(page);
    return good;
}

bool report_of_folder(const ReportOptions *options, Faults *faults)
{
    SessionArchive archive = {0};
    size_t length = 0;
    bool good = faults->count == 0 && session_archive_read(&archive, options->session, faults), has_any = !options->trainee;
    for (int i = 0; i < archive.count && !has_any; i++)
        has_any = !strcmp(archive.entry[i].session.trainee, options->trainee);
    for (int i = 0; good && i < archive.gap_count; i++)
        fprintf(stderr, "seldinger report: %s/%s: %s\n", options->session, archive.gap[i].file, archive.gap[i].why);
    if (good && !has_any) {
        faults_add(faults, options->session, 0, 0, "holds no session of '%s'; without --trainee the page lists all trainees", options->trainee);
        good = false;
    }
    if (good && (options->html || options->pdf)) {
        char *page = archive_page(&archive, options->session, options->trainee, &length, faults);
        good = report_write(options, page, length, faults);
    }
    good = good && (!options->csv || write_csv(options, &archive, faults));
    session_archive_free(&archive);
    return good;
}
