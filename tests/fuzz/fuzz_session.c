// Any bytes as a session: a session within its ranges that is the same when written and read again, or faults.
// Covers: sim/session.c sim/score_json.c
#include "sim/session.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Faults faults;
    static Session session, again;
    faults_clear(&faults);
    bool good = session_parse((const char *)data, size, "session.json", &session, &faults);
    if (good == (faults.count > 0))
        abort();
    if (!good)
        return 0;
    const ScoreFigures *f = &session.figures;
    if (!(f->points >= 0 && f->points <= 100) || !(f->path_mm >= 0) || session.event_count < 0 || session.event_count > SCORE_EVENTS_MOST || session.steps < 0)
        abort();
    char *text = session_json(&session);
    if (!text || !session_parse(text, strlen(text), "again.json", &again, &faults) || again.figures.points != f->points ||
        again.event_count != session.event_count)
        abort();
    free(text);
    return 0;
}
