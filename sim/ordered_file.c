#define _GNU_SOURCE   // locks of an open file, not of a process
#include "sim/ordered_file.h"

#include "base/heap.h"

#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { WORD = 8, MOST_BLOCKS = 512, MOST_PAGES = 2, NODE_HEAD = 24 };

// A piece of metadata that the library writes as one.
typedef struct Block {
    haddr_t address;
    size_t size;
    H5FD_mem_t type;
    unsigned char *wanted, *disk;   // after sealing
    bool dirty;
} Block;

struct OrderedFile {
    H5FD_t driver;   // the library's part, first
    int descriptor;
    haddr_t end;     // of what is allocated
    haddr_t ahead;   // the stated end is later than that by this, the file's length by twice this
    bool sealed;
    int index_entries, block_count;
    Block block[MOST_BLOCKS];
    int page_count;
    haddr_t page_start[MOST_PAGES];   // of those that hold headers
    unsigned char *page;   // page aligned: no fault in the middle of the kernel's copy
    const char *fault;
};

static void (*watch_write)(void *context, bool done);
static void *watch_context;

void ordered_file_watch(void (*watch)(void *context, bool done), void *context)
{
    watch_write = watch;
    watch_context = context;
}

static void watch(bool done)
{
    if (watch_write)
        watch_write(watch_context, done);
}

static bool refuse(OrderedFile *file, const char *why)
{
    file->fault = why;
    return false;
}

// --- plain reading and writing ---

static bool write_all(int descriptor, const unsigned char *data, size_t size, haddr_t address)
{
    while (size > 0) {
        ssize_t part = pwrite(descriptor, data, size, (off_t)address);
        if (part < 0 && errno == EINTR)
            continue;
        if (part <= 0)
            return false;
        data += part;
        size -= (size_t)part;
        address += (haddr_t)part;
    }
    return true;
}

// What lies beyond the file's end is zero.
static bool read_all(int descriptor, unsigned char *data, size_t size, haddr_t address)
{
    while (size > 0) {
        ssize_t part = pread(descriptor, data, size, (off_t)address);
        if (part < 0 && errno == EINTR)
            continue;
        if (part < 0)
            return false;
        if (part == 0) {
            memset(data, 0, size);
            return true;
        }
        data += part;
        size -= (size_t)part;
        address += (haddr_t)part;
    }
    return true;
}

static haddr_t length_of(int descriptor)
{
    struct stat status;
    return fstat(descriptor, &status) == 0 ? (haddr_t)status.st_size : HADDR_UNDEF;
}

static bool set_length(int descriptor, haddr_t size)
{
    while (ftruncate(descriptor, (off_t)size) != 0)
        if (errno != EINTR)
            return false;
    return true;
}

// To `size` and, where the disk has it, `more` beyond.
static bool grow(int descriptor, haddr_t size, haddr_t more)
{
    haddr_t now = length_of(descriptor);
    return now != HADDR_UNDEF && (now >= size + more || set_length(descriptor, size + more) || now >= size || set_length(descriptor, size));
}

// --- the end that the superblock states ---

static uint64_t little_endian(const unsigned char *data, int bytes)
{
    uint64_t value = 0;
    for (int i = bytes - 1; i >= 0; i--)
        value = value << 8 | data[i];
    return value;
}

static void put_little_endian(unsigned char *data, uint64_t value)
{
    for (int i = 0; i < WORD; i++)
        data[i] = (unsigned char)(value >> 8 * i);
}

// Behind version 0's 24 bytes of sizes, or version 1's 28, and two addresses.
static size_t end_field(const Block *superblock) { return superblock->disk[8] == 0 ? 40 : 44; }

static Block *superblock_of(OrderedFile *file)
{
    for (int i = 0; i < file->block_count; i++)
        if (file->block[i].type == H5FD_MEM_SUPER && file->block[i].address == 0)
            return &file->block[i];
    return NULL;
}

// What is to be stated, after the file has grown: ahead as far as it is long, and never less than before.
static void state_end_ahead(OrderedFile *file)
{
    Block *block = superblock_of(file);
    size_t field = end_field(block);
    haddr_t length = length_of(file->descriptor), end = file->end + file->ahead, before = little_endian(block->disk + field, WORD);
    end = length < end ? length : end;
    put_little_endian(block->wanted + field, end > before ? end : before);
    block->dirty = true;
}

static bool write_end(OrderedFile *file)
{
    Block *block = superblock_of(file);
    size_t field = end_field(block);
    if (memcmp(block->wanted + field, block->disk + field, WORD) == 0)
        return true;
    if (!write_all(file->descriptor, block->wanted + field, WORD, block->address + field))
        return false;
    memcpy(block->disk + field, block->wanted + field, WORD);
    return true;
}

// --- what the library calls ---

bool ordered_file_is_being_written(const char *path)
{
    struct flock lock = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
    int descriptor = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    bool is_locked = descriptor >= 0 && fcntl(descriptor, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
    if (descriptor >= 0)
        close(descriptor);
    return is_locked;
}

static H5FD_t *driver_open(const char *name, unsigned flags, hid_t access, haddr_t most)
{
    (void)access;
    (void)most;
    if (!(flags & H5F_ACC_TRUNC))
        return NULL;
    OrderedFile *file = calloc(1, sizeof *file);
    if (!file)
        return NULL;
    file->page = aligned_alloc(ORDERED_FILE_PAGE, ORDERED_FILE_PAGE);
    file->descriptor = file->page ? open(name, O_RDWR | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666) : -1;
    if (file->descriptor >= 0)
        (void)fcntl(file->descriptor, F_OFD_SETLK, &(struct flock){.l_type = F_WRLCK, .l_whence = SEEK_SET});   // some file systems have none
    if (file->descriptor < 0) {
        free(file->page);
        free(file);
        return NULL;
    }
    return &file->driver;
}

static herr_t driver_close(H5FD_t *driver)
{
    OrderedFile *file = (OrderedFile *)driver;
    bool good = true;
    if (file->sealed) {
        // whoever closes has committed: only the end is still ahead
        put_little_endian(superblock_of(file)->wanted + end_field(superblock_of(file)), file->end);
        good = write_end(file) && set_length(file->descriptor, file->end);
    }
    for (int i = 0; i < file->block_count; i++) {
        Block *block = &file->block[i];
        good = good && (!block->dirty || memcmp(block->wanted, block->disk, block->size) == 0);
        free(block->wanted);
        free(block->disk);
    }
    good = close(file->descriptor) == 0 && good;
    free(file->page);
    free(file);
    return good ? 0 : -1;
}

static herr_t driver_query(const H5FD_t *driver, unsigned long *flags)
{
    (void)driver;
    // no accumulator and no aggregation: every structure comes as its own write with its own type
    *flags = H5FD_FEAT_DEFAULT_VFD_COMPATIBLE;
    return 0;
}

static haddr_t driver_alloc(H5FD_t *driver, H5FD_mem_t type, hid_t transfer, hsize_t size)
{
    (void)type;
    (void)transfer;
    OrderedFile *file = (OrderedFile *)driver;
    haddr_t address = (file->end + WORD - 1) / WORD * WORD;
    file->end = address + size;
    return address;
}

static haddr_t driver_get_eoa(const H5FD_t *driver, H5FD_mem_t type)
{
    (void)type;
    return ((const OrderedFile *)driver)->end;
}

static herr_t driver_set_eoa(H5FD_t *driver, H5FD_mem_t type, haddr_t end)
{
    (void)type;
    ((OrderedFile *)driver)->end = end;
    return 0;
}

static haddr_t driver_get_eof(const H5FD_t *driver, H5FD_mem_t type)
{
    (void)type;
    return length_of(((const OrderedFile *)driver)->descriptor);
}

static herr_t driver_get_handle(H5FD_t *driver, hid_t access, void **handle)
{
    (void)access;
    *handle = driver;
    return 0;
}

static herr_t driver_read(H5FD_t *driver, H5FD_mem_t type, hid_t transfer, haddr_t address, size_t size, void *data)
{
    (void)transfer;
    OrderedFile *file = (OrderedFile *)driver;
    if (!read_all(file->descriptor, data, size, address))
        return -1;
    if (!file->sealed || type == H5FD_MEM_DRAW)
        return 0;
    for (int i = 0; i < file->block_count; i++) {
        const Block *block = &file->block[i];
        haddr_t from = block->address > address ? block->address : address, to = block->address + block->size;
        to = to < address + size ? to : address + size;
        if (from < to)
            memcpy((unsigned char *)data + (from - address), block->wanted + (from - block->address), to - from);
    }
    return 0;
}

static bool remember(OrderedFile *file, H5FD_mem_t type, haddr_t address, size_t size)
{
    int kept = 0;
    for (int i = 0; i < file->block_count; i++)   // what is written over is another structure now
        if (file->block[i].address + file->block[i].size <= address || address + size <= file->block[i].address)
            file->block[kept++] = file->block[i];
    file->block_count = kept;
    if (file->block_count == MOST_BLOCKS)
        return refuse(file, "more structures than a recording has");
    file->block[file->block_count++] = (Block){.address = address, .size = size, .type = type};
    return true;
}

static bool hold(OrderedFile *file, H5FD_mem_t type, haddr_t address, size_t size, const void *data)
{
    for (int i = 0; i < file->block_count; i++) {
        Block *block = &file->block[i];
        if (block->address == address && block->size == size && block->type == type) {
            memcpy(block->wanted, data, size);
            block->dirty = true;
            return true;
        }
    }
    return refuse(file, "the file's index is full");
}

static herr_t driver_write(H5FD_t *driver, H5FD_mem_t type, hid_t transfer, haddr_t address, size_t size, const void *data)
{
    (void)transfer;
    OrderedFile *file = (OrderedFile *)driver;
    if (file->sealed && type != H5FD_MEM_DRAW)
        return hold(file, type, address, size, data) ? 0 : -1;
    if (type != H5FD_MEM_DRAW && !remember(file, type, address, size))
        return -1;
    return write_all(file->descriptor, data, size, address) ? 0 : -1;
}

static herr_t driver_truncate(H5FD_t *driver, hid_t transfer, hbool_t closing)
{
    (void)transfer;
    (void)closing;
    OrderedFile *file = (OrderedFile *)driver;
    return file->sealed || grow(file->descriptor, file->end, 0) ? 0 : -1;
}

static const H5FD_class_t driver_class = {
#ifdef H5FD_CLASS_VERSION
    .version = H5FD_CLASS_VERSION,
    .value = 600,
#endif
    .name = "seldinger-ordered",
    .maxaddr = INT64_MAX,
    .fc_degree = H5F_CLOSE_WEAK,
    .open = driver_open,
    .close = driver_close,
    .query = driver_query,
    .alloc = driver_alloc,
    .get_eoa = driver_get_eoa,
    .set_eoa = driver_set_eoa,
    .get_eof = driver_get_eof,
    .get_handle = driver_get_handle,
    .read = driver_read,
    .write = driver_write,
    .truncate = driver_truncate,
    .fl_map = H5FD_FLMAP_DICHOTOMY,
};

// Kept until the program ends: a file that holds the driver last has HDF5 free it, and then call it to close the file (1.10.8, H5FD_close).
static hid_t driver_id(void)
{
    static hid_t driver = -1;
    if (driver < 0 || H5Iis_valid(driver) <= 0)
        driver = H5FDregister(&driver_class);
    return driver;
}

hid_t ordered_file_create(const char *path, hid_t creation, hid_t access)
{
    // 12 MB until the first chunks are there, of each of which a B-tree is made (H5B_create)
    if (!heap_has_room(4 * HEAP_ROOM_OF_HDF5)) {
        errno = ENOMEM;
        return -1;
    }
    errno = 0;
    hid_t driver = driver_id();
    return driver >= 0 && H5Pset_driver(access, driver, NULL) >= 0 ? H5Fcreate(path, H5F_ACC_TRUNC, creation, access) : -1;
}

OrderedFile *ordered_file_of(hid_t file)
{
    void *handle = NULL;
    return H5Fget_vfd_handle(file, H5P_DEFAULT, &handle) >= 0 ? handle : NULL;
}

const char *ordered_file_fault(const OrderedFile *file) { return file->fault; }

void ordered_file_start_page(OrderedFile *file)
{
    file->end = (file->end + ORDERED_FILE_PAGE - 1) / ORDERED_FILE_PAGE * ORDERED_FILE_PAGE;
    if (file->page_count < MOST_PAGES)
        file->page_start[file->page_count++] = file->end;
}

bool ordered_file_seal(OrderedFile *file, int index_entries, hsize_t ahead)
{
    file->index_entries = index_entries;
    file->ahead = ahead;
    for (int i = 0; i < file->block_count; i++) {
        Block *block = &file->block[i];
        if (block->address % WORD != 0)
            return refuse(file, "a structure does not start at a word");
        block->wanted = calloc(block->size + WORD, 1);   // whole words
        block->disk = calloc(block->size + WORD, 1);
        if (!block->wanted || !block->disk || !read_all(file->descriptor, block->disk, block->size, block->address))
            return false;
        memcpy(block->wanted, block->disk, block->size);
    }
    if (!superblock_of(file) || superblock_of(file)->disk[8] > 1)
        return refuse(file, "an unknown superblock");
    file->sealed = true;
    if (!grow(file->descriptor, file->end, 2 * ahead))
        return false;
    state_end_ahead(file);
    return write_end(file);
}

// --- committing ---

// The first changed word at or after the byte `from`, or the block's size.
static size_t next_change(const Block *block, size_t from)
{
    while (from < block->size && memcmp(block->wanted + from, block->disk + from, WORD) == 0)
        from += WORD;
    return from < block->size ? from : block->size;
}

// Rule 1: the end of file grows, nothing else changes.
static bool superblock_fits(const Block *block)
{
    size_t field = end_field(block), rest = field + WORD;
    return block->disk[8] <= 1 && block->size > rest && memcmp(block->wanted, block->disk, field) == 0 &&
           memcmp(block->wanted + rest, block->disk + rest, block->size - rest) == 0 &&
           little_endian(block->wanted + field, WORD) >= little_endian(block->disk + field, WORD);
}

// Rules 2 and 3: a node (signature 4, type 1, level 1, entries 2, siblings 16, then key, child, key, …, key) gets entries at its end.
static bool node_fits(const OrderedFile *file, const Block *block)
{
    if (next_change(block, 0) == block->size)
        return true;
    size_t children = (size_t)file->index_entries * WORD, keys = (size_t)file->index_entries + 1;
    if (block->size < NODE_HEAD + children + keys || (block->size - NODE_HEAD - children) % keys != 0)
        return false;
    size_t key = (block->size - NODE_HEAD - children) / keys;
    uint64_t before = little_endian(block->disk + 6, 2), after = little_endian(block->wanted + 6, 2);
    if (memcmp(block->disk, "TREE", 4) != 0 || memcmp(block->disk, block->wanted, 6) != 0 || before < 1 || after < before ||
        after > (uint64_t)file->index_entries)
        return false;
    // the leading index (after a key's first word) of key n: above the last chunk's afterwards, and never falling
    size_t bound = NODE_HEAD + (size_t)before * (key + WORD), leading = bound + WORD, last = leading - key - WORD;
    uint64_t new = little_endian(block->wanted + leading, WORD);
    return next_change(block, WORD) >= bound && new > little_endian(block->disk + last, WORD) && new >= little_endian(block->disk + leading, WORD);
}

static bool lies_in(haddr_t address, haddr_t page_start) { return address >= page_start && address < page_start + ORDERED_FILE_PAGE; }

// Rule 4: one word of each header, in a started page.
static bool header_fits(const OrderedFile *file, const Block *block)
{
    size_t change = next_change(block, 0);
    bool inside = change == block->size;
    for (int i = 0; i < file->page_count; i++)
        inside |= lies_in(block->address + change, file->page_start[i]);
    return inside && next_change(block, change + WORD) == block->size;
}

static bool all_fits(OrderedFile *file)
{
    for (int i = 0; i < file->block_count; i++) {
        const Block *block = &file->block[i];
        bool good = !block->dirty || (block->type == H5FD_MEM_SUPER   ? superblock_fits(block)
                                      : block->type == H5FD_MEM_BTREE ? node_fits(file, block)
                                      : block->type == H5FD_MEM_OHDR  ? header_fits(file, block)
                                                                      : next_change(block, 0) == block->size);
        if (!good)
            return refuse(file, "the file's structure would change");
    }
    return true;
}

// The changed words of all blocks of a type, one write each, in the order of their addresses within a block.
static bool write_words(OrderedFile *file, H5FD_mem_t type, size_t from, size_t to)
{
    for (int i = 0; i < file->block_count; i++) {
        Block *block = &file->block[i];
        if (!block->dirty || block->type != type)
            continue;
        size_t end = to < block->size ? to : block->size;
        for (size_t at = next_change(block, from); at < end; at = next_change(block, at)) {
            watch(false);
            if (!write_all(file->descriptor, block->wanted + at, WORD, block->address + at))
                return false;
            memcpy(block->disk + at, block->wanted + at, WORD);
        }
    }
    return true;
}

static bool write_extents(OrderedFile *file, haddr_t start)
{
    size_t first = ORDERED_FILE_PAGE, last = 0;
    if (!read_all(file->descriptor, file->page, ORDERED_FILE_PAGE, start))
        return false;
    for (int i = 0; i < file->block_count; i++) {
        Block *block = &file->block[i];
        size_t change = block->dirty && block->type == H5FD_MEM_OHDR ? next_change(block, 0) : block->size;
        if (change == block->size || !lies_in(block->address + change, start))
            continue;
        size_t at = (size_t)(block->address + change - start);
        memcpy(file->page + at, block->wanted + change, WORD);
        memcpy(block->disk + change, block->wanted + change, WORD);
        first = at < first ? at : first;
        last = at + WORD > last ? at + WORD : last;
    }
    if (last == 0)
        return true;
    watch(false);
    // one call where the system takes it whole; a part alone would never become a whole
    return write_all(file->descriptor, file->page + first, last - first, start + first);
}

bool ordered_file_commit(OrderedFile *file)
{
    if (file->fault)
        return false;
    watch(false);
    if (!grow(file->descriptor, file->end, 2 * file->ahead))
        return false;
    state_end_ahead(file);
    if (!all_fits(file))
        return false;
    watch(false);
    bool good = write_end(file) && write_words(file, H5FD_MEM_BTREE, WORD, SIZE_MAX) && write_words(file, H5FD_MEM_BTREE, 0, WORD);
    for (int i = 0; good && i < file->page_count; i++)
        good = write_extents(file, file->page_start[i]);
    for (int i = 0; good && i < file->block_count; i++)
        file->block[i].dirty = false;
    watch(true);
    return good;
}
