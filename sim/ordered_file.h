// An HDF5 file whose every state on the disk is a whole file: a virtual file driver that holds metadata back and applies it in order.
//
// Made for a recording: all structure is built first, then datasets only grow by rows. Two times:
//   - before ordered_file_seal() everything is written as it comes; the file has no name of its own yet, nobody reads it;
//   - after it, rows (H5FD_MEM_DRAW) are written as they come and metadata is held in memory, also where the library evicts it
//     outside a flush; H5Fflush() followed by ordered_file_commit() applies it.
// Why every prefix of a commit's writes is a whole file that holds exactly the rows of the last commit or of this one (of each page's datasets):
//   rows     lie beyond the extents that the file states, so no reader sees them; new chunks lie in space that no index names.
//   0 length the file grows to its allocated end. A file longer than its superblock says is valid, a shorter one is not.
//   1 end    the superblock's end of file, 8 bytes in the first page; it may grow only, and step 0 has made it true.
//   2 slots  of version 1 B-tree nodes with n entries: the words from key n on. Keys 0 … n-1 and children 0 … n-1 stay. Child n and what
//            follows is not looked at while the node states n entries. Key n bounds the last chunk c from above: it becomes the next chunk's
//            key, whose leading index is above c's; that index is written before the lesser ones, so key n is above chunk c throughout.
//   3 counts the nodes' leading words, n becomes n+1 (…): the slots are there. The new chunks hold rows beyond the stated extents only.
//   4 extents of all datasets of a page at once: the object headers that change lie within a started page, so that this is one write. Of two
//            pages the one started first is written first, and a file between those two writes is whole as well.
// A reader that opens the file meanwhile asks for its length, then for the superblock's end (refused where it is beyond that length), then for
// chunks (refused where they are beyond that end). So the end is stated, and the length is, a chunk of every dataset or more ahead: a reader
// may be a chunk's time late from one to the next. A slower one opens the file again. Closing states the true end, then cuts the file there.
// A word is 8 bytes at an address that is a multiple of 8, a page 4096 bytes. SIGKILL ends a write to a file between pages only (the kernel
// copies what lies within a page in one piece), so each of these writes is done whole or not at all. A loss of power is not covered.
// A commit first compares what it is to write with these rules and refuses whatever does not fit (a node that splits, any other structure):
// then nothing is written and the file stays as the last commit left it.
#ifndef SELDINGER_SIM_ORDERED_FILE_H
#define SELDINGER_SIM_ORDERED_FILE_H

#include <hdf5.h>
#include <stdbool.h>

enum { ORDERED_FILE_PAGE = 4096 };

typedef struct OrderedFile OrderedFile;

// Makes and truncates. `access` gets this driver.
hid_t ordered_file_create(const char *path, hid_t creation, hid_t access);
OrderedFile *ordered_file_of(hid_t file);
// What is allocated next starts a page: the object headers of datasets that are to grow together, made right after. Two pages at most.
void ordered_file_start_page(OrderedFile *file);
// Whether a program, this one too, has the file open for writing. The lock is the kernel's and advisory: it ends with the program, and readers are not kept out.
bool ordered_file_is_being_written(const char *path);
// After an H5Fflush(). `index_entries`: of a chunk index' node, twice H5Pset_istore_k()'s value. `ahead`: bytes that may be allocated
// between a reader's first look and its last.
bool ordered_file_seal(OrderedFile *file, int index_entries, hsize_t ahead);
// After an H5Fflush().
bool ordered_file_commit(OrderedFile *file);
// What was refused, or NULL.
const char *ordered_file_fault(const OrderedFile *file);

// For tests: called before each write of each commit and (`done`) after its last. For all files of the process.
void ordered_file_watch(void (*watch)(void *context, bool done), void *context);

#endif
