// The results of a sweep as they come: RESULTS/journal.txt, one line for each, `JSON TAB CHECKSUM`, where the checksum is the first 16 digits of the SHA-256 of
// the JSON. The first line says what the results are of: program, specification, files. A line is written by one call and is in the system's hands before the
// next run begins, so a kill loses only runs in flight; the disk has it at most a second later, for a loss of power.
#ifndef SELDINGER_STUDY_JOURNAL_H
#define SELDINGER_STUDY_JOURNAL_H

#include "base/base.h"

#include <cJSON.h>
#include <stdint.h>

typedef struct Journal Journal;

// Opens the journal in `folder`, which is created with its parents, and locks the folder for this process, or begins one. `heading`: what the results are of;
// if the journal has another one, what differs is a fault. A last line that was cut off is removed. NULL with faults.
Journal *journal_open(const char *folder, const cJSON *heading, int64_t runs, Faults *faults);
void journal_close(Journal *journal);            // NULL is allowed
// Calls `each` for every sound result, in the order of the file. `text` is its JSON, NUL-terminated, for this call only. Damaged lines are skipped and counted.
typedef void JournalReader(void *context, int64_t run, const char *text, int64_t offset);
int64_t journal_read(Journal *journal, JournalReader *each, void *context);
// The JSON of the result at `offset`; the caller frees it. NULL if it cannot be read.
char *journal_at(Journal *journal, int64_t offset);
// Appends a result. False with a fault (full disk): the journal is then as before.
bool journal_add(Journal *journal, const char *text, Faults *faults);
const char *journal_path(const Journal *journal);

#endif
