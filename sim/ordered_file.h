// An HDF5 file that is valid on disk at any time while its datasets grow by chunks.
//
// HDF5's SWMR mode was measured as an alternative (1.10.8, 50 runs killed at random): readers without the SWMR flag could open the file in none of them, during
// writing or after SIGKILL, because it stays marked as open for writing; readers with the flag found all flushed rows in all of them. The size is the same; a
// row of 12 datasets takes 72 us (70 us here).
//
// It is used for recordings. Writing has two phases:
//   - the HDF5 library builds the structure (ordered_file_create, ordered_file_start_page) and closes the file, which does not have its final name yet;
//   - then only this module writes the file: packed chunks, entries of the chunk indices (B-trees of version 1) and extents in the datasets' headers.
// Every prefix of the writes is a valid file that holds exactly the rows of the last commit or of the current one (for the datasets of each page), because:
//   chunks   are written to space that no index refers to; then the index refers to them, in rows beyond the stated extents. No reader sees them.
//   end      first the file grows, then the superblock's end of file, then an index refers to the new space. A file longer than its stated end is valid.
//   entries  an index has two levels: a root of `fan` leaves of `fan` chunks each. A leaf first gets its next key and child, then its count. A new
//            leaf is written as a whole, then its neighbour's link and the root's next key and child, then the root's count. Entries beyond a
//            node's count are ignored. Keys always bound the entries below them from above, because chunks come in order: the key after the last
//            chunk is where the next one begins.
//   extents  of all datasets with headers on one page are written at once. Pages are written in the order in which they were started, and the file is
//            valid between these writes too.
// A reader that opens the file meanwhile reads its length, then the superblock's end (refused if beyond that length), then chunks (refused if beyond that end).
// The stated end and the length are therefore kept some bytes ahead, and a reader may lag by that amount of writing; a slower one opens the file again. Closing
// writes the true end, then truncates the file there. A word is 8 bytes at an address that is a multiple of 8, a page 4096 bytes. SIGKILL interrupts a write to
// a file only between pages (the kernel copies the part within a page in one piece), so the write of a word or of a page is atomic. Loss of power is not
// covered.
#ifndef SELDINGER_SIM_ORDERED_FILE_H
#define SELDINGER_SIM_ORDERED_FILE_H

#include <hdf5.h>
#include <stdbool.h>

enum { ORDERED_FILE_PAGE = 4096, ORDERED_FILE_MOST_SETS = 96 };

// --- building ---

// Creates or truncates the file. `access` gets this module's driver. The library writes superblock and headers of version 1 if `access` allows its earliest
// format.
hid_t ordered_file_create(const char *path, hid_t creation, hid_t access);
// Makes the next allocation start a page: for the object headers, created directly afterwards, of datasets that grow together.
void ordered_file_start_page(hid_t file);

// --- growing ---

typedef struct OrderedFile OrderedFile;

// Opens a file that the library has closed. `half_fan`: the argument of H5Pset_istore_k(). `ahead`: bytes that may be written between a reader's first and last
// read. NULL if the file was not created by this module or cannot be opened.
OrderedFile *ordered_file_open(const char *path, int half_fan, hsize_t ahead);
// Adds a dataset that will grow: chunked, with first dimension 0. `header`: its address (H5O_info_t). Returns its number, counted from 0; -1 if its header is
// not as expected.
int ordered_file_add(OrderedFile *file, haddr_t header, int rank, hsize_t chunk_rows);
// Appends the next chunk, compressed by the dataset's filters. False if it cannot be written or the index is full (errno or ordered_file_fault).
bool ordered_file_append(OrderedFile *file, int set, const void *chunk, size_t bytes);
// Sets the number of rows from the next commit on; at most the number appended.
void ordered_file_set_rows(OrderedFile *file, int set, hsize_t rows);
bool ordered_file_commit(OrderedFile *file);
// The reason of a refusal, or NULL.
const char *ordered_file_fault(const OrderedFile *file);
// Writes the true end if `is_whole`, and frees the file. False if writing failed.
bool ordered_file_close(OrderedFile *file, bool is_whole);

// Whether any program, including this one, has the file open for writing. The lock is the kernel's and advisory: it ends with the program and does not keep
// readers out.
bool ordered_file_is_being_written(const char *path);

// For tests: called before each write that changes what a reader could see and, with `done`, after the last write of a commit. Applies to all files of the
// process.
void ordered_file_watch(void (*watch)(void *context, bool done), void *context);

#endif
