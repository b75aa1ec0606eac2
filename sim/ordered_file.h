// An HDF5 file that is valid on disk at any time while its datasets grow by chunks.
//
// HDF5's SWMR was measured instead (1.10.8, killed 50 times): plain readers could open the file 0 times of 50, while it was written as after SIGKILL, as it is
// marked open for writing; readers with the SWMR flag had all flushed rows 50 times. Its size is the same, its cost 72 us a row of 12 datasets (70 without).
//
// Made for recordings. Two phases:
//   - the HDF5 library builds the structure (ordered_file_create, ordered_file_start_page) and closes the file, which has no name of its own yet;
//   - then only this module writes it: packed chunks, the entries of the chunk indices (B-trees of version 1) and the extents in the headers of the
//     datasets.
// Why every prefix of the writes is a valid file that holds exactly the rows of the last commit or of this one (for each page's datasets):
//   chunks   lie in space that no index names, then in rows beyond the extents that the file states, so no reader sees them.
//   end      the file grows, then the superblock's end of file does, before an index names what lies there: a file longer than it says is valid.
//   entries  an index has two levels: a root of `fan` leaves of `fan` chunks each. A leaf gets its next key and child, then its count. A new leaf is written whole, then
//            its neighbour's link and the root's next key and child, then the root's count. Entries beyond a node's count are ignored. Keys bound
//            what is below them from above throughout, as chunks come in order: the key behind the last one is where the next begins.
//   extents of all datasets with headers on a page in one write. Of several pages the one started first is written first, and the file is valid
//   between those writes too.
// A reader that opens the file meanwhile asks for its length, then for the superblock's end (refused where it is beyond that length), then for chunks
// (refused where they are beyond that end). So the stated end and the length are kept some bytes ahead: a reader may lag by that amount of writing. A
// slower one opens the file again. Closing states the true end, then cuts the file there. A word is 8 bytes at an address that is a multiple of 8, a
// page 4096 bytes. SIGKILL ends a write to a file between pages only (the kernel copies what lies within a page in one piece), so the write of a word
// or of a page is atomic. A loss of power is not covered.
#ifndef SELDINGER_SIM_ORDERED_FILE_H
#define SELDINGER_SIM_ORDERED_FILE_H

#include <hdf5.h>
#include <stdbool.h>

enum { ORDERED_FILE_PAGE = 4096, ORDERED_FILE_MOST_SETS = 96 };

// --- building ---

// Makes and truncates. `access` gets a driver of our own. The library writes superblock and headers of version 1 where `access` has its earliest format.
hid_t ordered_file_create(const char *path, hid_t creation, hid_t access);
// Makes the next allocation start a page: for the object headers of datasets that grow together, created right after.
void ordered_file_start_page(hid_t file);

// --- growing ---

typedef struct OrderedFile OrderedFile;

// Opens a file that the library has closed. `half_fan`: the argument of H5Pset_istore_k(). `ahead`: bytes that may be written between a reader's
// first and last read. NULL if the file was not made by this module or cannot be opened.
OrderedFile *ordered_file_open(const char *path, int half_fan, hsize_t ahead);
// Adds a dataset that will grow: chunked, its first dimension 0. `header`: its address (H5O_info_t). The datasets are numbered from 0; -1 where its
// header is not as expected.
int ordered_file_add(OrderedFile *file, haddr_t header, int rank, hsize_t chunk_rows);
// Appends its next chunk, compressed according to its filters. False if it cannot be written or the index is full (errno or ordered_file_fault).
bool ordered_file_append(OrderedFile *file, int set, const void *chunk, size_t bytes);
// Sets the number of rows from the next commit on; at most those appended.
void ordered_file_set_rows(OrderedFile *file, int set, hsize_t rows);
bool ordered_file_commit(OrderedFile *file);
// The reason of a refusal, or NULL.
const char *ordered_file_fault(const OrderedFile *file);
// Writes the true end if `is_whole`, and frees. False if that failed.
bool ordered_file_close(OrderedFile *file, bool is_whole);

// Whether a program, this one too, has the file open for writing. The lock is the kernel's and advisory: it ends with the program, and readers are not kept out.
bool ordered_file_is_being_written(const char *path);

// For tests: called before each write that changes what a reader could see and (`done`) after the last of a commit. For all files of the process.
void ordered_file_watch(void (*watch)(void *context, bool done), void *context);

#endif
