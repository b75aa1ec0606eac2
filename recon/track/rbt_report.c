#include "recon/track/rbt_report.h"

#include <stdlib.h>

const char *const rbt_doubt_name[RBT_DOUBTS] = {"drift", "inliers", "radius", "shape", "noise", "background", "length", "sac"};

void rbt_report_free(RbtReport *report)
{
    free(report->branch);
    free(report->junction);
    free(report->loop);
    *report = (RbtReport){0};
}
