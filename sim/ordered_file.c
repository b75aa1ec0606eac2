#define _GNU_SOURCE   // locks of an open file description, not of a process
#include "sim/ordered_file.h"

#include "base/base.h"

#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { WORD = 8, MOST_PAGES = 24, NODE_HEAD = 24, MOST_KEY = 48, MOST_HEADER = 1024 };

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

// Bytes beyond the file's end read as zero.
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

// Grows the file to `size`, plus `more` if the disk has space.
static bool grow(int descriptor, haddr_t size, haddr_t more)
{
    haddr_t now = length_of(descriptor);
    return now != HADDR_UNDEF && (now >= size + more || set_length(descriptor, size + more) || now >= size || set_length(descriptor, size));
}

static uint64_t little_endian(const unsigned char *data, int bytes)
{
    uint64_t value = 0;
    for (int i = bytes - 1; i >= 0; i--)
        value = value << 8 | data[i];
    return value;
}

static void put_little_endian(unsigned char *data, uint64_t value, int bytes)
{
    for (int i = 0; i < bytes; i++)
        data[i] = (unsigned char)(value >> 8 * i);
}

// --- building: a driver that allocates consecutive addresses, aligned to words ---

typedef struct Build {
    H5FD_t driver;   // the library's part must come first
    int descriptor;
    haddr_t end;     // of the allocated space
} Build;

static H5FD_t *driver_open(const char *name, unsigned flags, hid_t access, haddr_t most)
{
    (void)access;
    (void)most;
    Build *file = flags & H5F_ACC_TRUNC ? calloc(1, sizeof *file) : NULL;
    if (!file)
        return NULL;
    file->descriptor = open(name, O_RDWR | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (file->descriptor >= 0)
        return &file->driver;
    free(file);
    return NULL;
}

static herr_t driver_close(H5FD_t *driver)
{
    Build *file = (Build *)driver;
    bool good = close(file->descriptor) == 0;
    free(file);
    return good ? 0 : -1;
}

static herr_t driver_query(const H5FD_t *driver, unsigned long *flags)
{
    (void)driver;
    // no accumulator and no aggregation: headers stay where they are allocated
    *flags = H5FD_FEAT_DEFAULT_VFD_COMPATIBLE;
    return 0;
}

static haddr_t driver_alloc(H5FD_t *driver, H5FD_mem_t type, hid_t transfer, hsize_t size)
{
    (void)type;
    (void)transfer;
    Build *file = (Build *)driver;
    haddr_t address = (file->end + WORD - 1) / WORD * WORD;
    file->end = address + size;
    return address;
}

static haddr_t driver_get_eoa(const H5FD_t *driver, H5FD_mem_t type)
{
    (void)type;
    return ((const Build *)driver)->end;
}

static herr_t driver_set_eoa(H5FD_t *driver, H5FD_mem_t type, haddr_t end)
{
    (void)type;
    ((Build *)driver)->end = end;
    return 0;
}

static haddr_t driver_get_eof(const H5FD_t *driver, H5FD_mem_t type)
{
    (void)type;
    return length_of(((const Build *)driver)->descriptor);
}

static herr_t driver_get_handle(H5FD_t *driver, hid_t access, void **handle)
{
    (void)access;
    *handle = driver;
    return 0;
}

static herr_t driver_read(H5FD_t *driver, H5FD_mem_t type, hid_t transfer, haddr_t address, size_t size, void *data)
{
    (void)type;
    (void)transfer;
    return read_all(((Build *)driver)->descriptor, data, size, address) ? 0 : -1;
}

static herr_t driver_write(H5FD_t *driver, H5FD_mem_t type, hid_t transfer, haddr_t address, size_t size, const void *data)
{
    (void)type;
    (void)transfer;
    return write_all(((Build *)driver)->descriptor, data, size, address) ? 0 : -1;
}

static herr_t driver_truncate(H5FD_t *driver, hid_t transfer, hbool_t closing)
{
    (void)transfer;
    (void)closing;
    Build *file = (Build *)driver;
    return grow(file->descriptor, file->end, 0) ? 0 : -1;
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

// Registered until the program ends: if a file holds the last reference to the driver, HDF5 frees the driver and then calls it to close the file (1.10.8,
// H5FD_close).
static hid_t driver_id(void)
{
    static hid_t driver = -1;
    if (driver < 0 || H5Iis_valid(driver) <= 0)
        driver = H5FDregister(&driver_class);
    return driver;
}

hid_t ordered_file_create(const char *path, hid_t creation, hid_t access)
{
    // 12 MB are needed until the first chunks exist: HDF5 makes a B-tree for each dataset (H5B_create)
    if (!heap_can_allocate(4 * HEAP_RESERVE_OF_HDF5)) {
        errno = ENOMEM;
        return -1;
    }
    errno = 0;
    hid_t driver = driver_id();
    return driver >= 0 && H5Pset_driver(access, driver, NULL) >= 0 ? H5Fcreate(path, H5F_ACC_TRUNC, creation, access) : -1;
}

void ordered_file_start_page(hid_t file)
{
    void *handle = NULL;
    if (H5Fget_vfd_handle(file, H5P_DEFAULT, &handle) < 0)
        return;
    Build *build = handle;
    build->end = (build->end + ORDERED_FILE_PAGE - 1) / ORDERED_FILE_PAGE * ORDERED_FILE_PAGE;
}

bool ordered_file_is_being_written(const char *path)
{
    struct flock lock = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
    int descriptor = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    bool is_locked = descriptor >= 0 && fcntl(descriptor, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
    if (descriptor >= 0)
        close(descriptor);
    return is_locked;
}

// --- growing ---

// A dataset and its chunk index.
typedef struct Set {
    haddr_t extent, root_field;              // addresses in its header
    int rank;
    hsize_t chunk_rows, chunks;              // rows per chunk; chunks appended
    haddr_t root, leaf;                      // the root node, and the last leaf
} Set;

// A page that holds extents: its content on disk and its new content.
typedef struct Page {
    haddr_t start;
    unsigned char *disk, *wanted;            // page-aligned, so that the kernel's copy causes no page fault midway
} Page;

struct OrderedFile {
    int descriptor;
    size_t end_field;                        // where the superblock stores the end
    haddr_t end, stated, ahead;              // end of the used space; the superblock's end; bytes it is kept ahead
    int fan;                                 // most children of a node
    int set_count, page_count;
    Set set[ORDERED_FILE_MOST_SETS];
    Page page[MOST_PAGES];
    unsigned char *node;                     // scratch
    const char *fault;
};

const char *ordered_file_fault(const OrderedFile *file) { return file->fault; }

static bool refuse(OrderedFile *file, const char *why)
{
    file->fault = why;
    return false;
}

// Bytes of a chunk's key: chunk size and filter mask, then the offset of its first value in each dimension and within a value.
static size_t key_bytes(const Set *set) { return WORD + WORD * (size_t)(set->rank + 1); }
static size_t node_bytes(const OrderedFile *file, const Set *set) { return NODE_HEAD + (size_t)file->fan * WORD + (size_t)(file->fan + 1) * key_bytes(set); }
static haddr_t key_address(const Set *set, haddr_t node, uint64_t i) { return node + NODE_HEAD + i * (key_bytes(set) + WORD); }

OrderedFile *ordered_file_open(const char *path, int half_fan, hsize_t ahead)
{
    static const unsigned char signature[8] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
    unsigned char super[64];
    OrderedFile *file = calloc(1, sizeof *file);
    if (!file)
        return NULL;
    file->fan = 2 * half_fan;
    SEL_ASSERT(half_fan > 0, "a node has children");
    file->ahead = ahead;
    file->node = calloc(1, NODE_HEAD + (size_t)file->fan * (MOST_KEY + WORD) + MOST_KEY);
    file->descriptor = open(path, O_RDWR | O_NOFOLLOW | O_CLOEXEC);
    bool good = file->node && file->descriptor >= 0 && read_all(file->descriptor, super, sizeof super, 0) && !memcmp(super, signature, sizeof signature) &&
                super[8] <= 1;
    if (good) {
        (void)fcntl(file->descriptor, F_OFD_SETLK, &(struct flock){.l_type = F_WRLCK, .l_whence = SEEK_SET});   // some file systems support no locks
        file->end_field = super[8] == 0 ? 40 : 44;      // after two addresses and 24 bytes (version 0) or 28 (version 1)
        file->end = file->stated = little_endian(super + file->end_field, WORD);
        return file;
    }
    ordered_file_close(file, false);
    return NULL;
}

static Page *page_of(OrderedFile *file, haddr_t address)
{
    SEL_ASSERT(address > 0 && address != HADDR_UNDEF, "the address lies in the file");
    haddr_t start = address / ORDERED_FILE_PAGE * ORDERED_FILE_PAGE;
    for (int i = 0; i < file->page_count; i++)
        if (file->page[i].start == start)
            return &file->page[i];
    Page page = {.start = start};
    if (file->page_count == MOST_PAGES)
        return NULL;
    page.disk = aligned_alloc(ORDERED_FILE_PAGE, 2 * ORDERED_FILE_PAGE);
    if (!page.disk || !read_all(file->descriptor, page.disk, ORDERED_FILE_PAGE, start)) {
        free(page.disk);
        return NULL;
    }
    page.wanted = page.disk + ORDERED_FILE_PAGE;
    memcpy(page.wanted, page.disk, ORDERED_FILE_PAGE);
    file->page[file->page_count] = page;
    return &file->page[file->page_count++];
}

// An object header of version 1: 16 bytes, then messages, each with type, size, flags and data. Needed are the address of the first dimension in a dataspace of
// version 1, and that of the address in a layout of version 3.
int ordered_file_add(OrderedFile *file, haddr_t header, int rank, hsize_t chunk_rows)
{
    SEL_ASSERT(rank > 0 && chunk_rows > 0, "a dataset grows by chunks of rows");
    enum { DATASPACE = 1, LAYOUT = 8, CHUNKED = 2, HEAD = 16, MESSAGE = 8 };
    unsigned char bytes[MOST_HEADER];
    Set set = {.rank = rank, .chunk_rows = chunk_rows};
    SEL_REQUIRE(key_bytes(&set) <= MOST_KEY, "the scratch has room for a key of each dimension");
    if (file->set_count == ORDERED_FILE_MOST_SETS || !read_all(file->descriptor, bytes, sizeof bytes, header) || bytes[0] != 1)
        return -1;
    size_t size = HEAD + little_endian(bytes + 8, 4);
    for (size_t at = HEAD; at + MESSAGE <= size && size <= MOST_HEADER;) {
        unsigned type = (unsigned)little_endian(bytes + at, 2), length = (unsigned)little_endian(bytes + at + 2, 2);
        const unsigned char *data = bytes + at + MESSAGE;
        if (type == DATASPACE && data[0] == 1 && data[1] == rank)
            set.extent = header + at + MESSAGE + 8;
        if (type == LAYOUT && data[0] == 3 && data[1] == CHUNKED)
            set.root_field = header + at + MESSAGE + 3;
        at += MESSAGE + length;
    }
    if (set.extent == 0 || set.root_field == 0 || set.extent % WORD != 0 || !page_of(file, set.extent))
        return -1;
    file->set[file->set_count] = set;
    return file->set_count++;
}

// Ensures that a reader finds the end of file after all used bytes.
static bool state_end(OrderedFile *file, haddr_t end)
{
    unsigned char word[WORD];
    haddr_t length;
    if (!grow(file->descriptor, end, file->ahead) || (length = length_of(file->descriptor)) == HADDR_UNDEF)
        return false;
    end = length < end ? length : end;
    if (end <= file->stated)
        return true;
    put_little_endian(word, end, WORD);
    watch(false);
    file->stated = end;
    return write_all(file->descriptor, word, WORD, file->end_field);
}

// The address of new space, 0 if there is none.
static haddr_t take_space(OrderedFile *file, size_t bytes)
{
    SEL_ASSERT(bytes > 0 && file->end <= file->stated, "the used space ends before the superblock's end");
    haddr_t address = (file->end + WORD - 1) / WORD * WORD;
    if (address + bytes > file->stated && !state_end(file, address + bytes + file->ahead) && !state_end(file, address + bytes))
        return 0;
    file->end = address + bytes;
    return address;
}

static void put_key(const Set *set, unsigned char *key, uint64_t bytes, hsize_t row)
{
    SEL_ASSERT(bytes <= UINT32_MAX, "a chunk's size fits 32 bits");
    memset(key, 0, key_bytes(set));
    put_little_endian(key, bytes, 4);
    put_little_endian(key + WORD, row, WORD);
}

// A key, its child, and the key that bounds the child from above.
static size_t put_entry(const Set *set, unsigned char *at, uint64_t bytes, hsize_t row, haddr_t child, hsize_t next_row)
{
    put_key(set, at, bytes, row);
    put_little_endian(at + key_bytes(set), child, WORD);
    put_key(set, at + key_bytes(set) + WORD, 0, next_row);
    return 2 * key_bytes(set) + WORD;
}

static void put_node_head(unsigned char *node, int level, uint64_t count)
{
    SEL_ASSERT(count <= UINT16_MAX && level >= 0 && level < 2, "an index has two levels");
    memcpy(node, "TREE", 4);
    node[4] = 1;      // a node of chunks
    node[5] = (unsigned char)level;
    put_little_endian(node + 6, count, 2);
}

// A new node with one entry. 0 if there is no space.
static haddr_t make_node(OrderedFile *file, const Set *set, int level, haddr_t left, uint64_t bytes, hsize_t row, haddr_t child, hsize_t next_row)
{
    size_t size = node_bytes(file, set);
    haddr_t address = take_space(file, size);
    memset(file->node, 0, size);
    put_node_head(file->node, level, 1);
    put_little_endian(file->node + 8, left, WORD);
    put_little_endian(file->node + 16, HADDR_UNDEF, WORD);
    put_entry(set, file->node + NODE_HEAD, bytes, row, child, next_row);
    watch(false);
    return address && write_all(file->descriptor, file->node, size, address) ? address : 0;
}

// Appends entry `i` to a node that has `i` entries.
static bool add_entry(OrderedFile *file, const Set *set, haddr_t node, int level, uint64_t i, uint64_t bytes, hsize_t row, haddr_t child, hsize_t next_row)
{
    SEL_REQUIRE(i > 0 && i < (uint64_t)file->fan, "a node has room for another child");
    unsigned char entry[2 * MOST_KEY + WORD], head[WORD];
    size_t size = put_entry(set, entry, bytes, row, child, next_row);
    put_node_head(head, level, i + 1);
    watch(false);
    if (!write_all(file->descriptor, entry, size, key_address(set, node, i)))
        return false;
    watch(false);
    return write_all(file->descriptor, head, WORD, node);
}

static bool write_word(OrderedFile *file, haddr_t address, uint64_t value)
{
    unsigned char word[WORD];
    put_little_endian(word, value, WORD);
    watch(false);
    return write_all(file->descriptor, word, WORD, address);
}

// Creates the index of a dataset without chunks: a root, a leaf, and their address in the header. Only for a file without readers.
static bool make_index(OrderedFile *file, Set *set, size_t bytes, haddr_t chunk)
{
    const hsize_t leaf_rows = (hsize_t)file->fan * set->chunk_rows;
    Page *page = page_of(file, set->root_field);
    set->leaf = make_node(file, set, 0, HADDR_UNDEF, bytes, 0, chunk, set->chunk_rows);
    set->root = set->leaf ? make_node(file, set, 1, HADDR_UNDEF, bytes, 0, set->leaf, leaf_rows) : 0;
    if (!page || set->root == 0 || !write_word(file, set->root_field, set->root))
        return false;
    for (size_t i = 0; i < WORD; i++)      // it may lie on a buffered page, whose copy must match
        if ((page = page_of(file, set->root_field + i)))
            page->disk[(set->root_field + i) % ORDERED_FILE_PAGE] = page->wanted[(set->root_field + i) % ORDERED_FILE_PAGE] =
                (unsigned char)(set->root >> 8 * i);
    return page != NULL;
}

static bool add_leaf(OrderedFile *file, Set *set, uint64_t leaf, size_t bytes, hsize_t row, haddr_t chunk)
{
    const hsize_t leaf_rows = (hsize_t)file->fan * set->chunk_rows;
    haddr_t node = make_node(file, set, 0, set->leaf, bytes, row, chunk, row + set->chunk_rows);
    if (node == 0 || !write_word(file, set->leaf + 16, node))
        return false;
    set->leaf = node;
    return add_entry(file, set, set->root, 1, leaf, bytes, row, node, row + leaf_rows);
}

bool ordered_file_append(OrderedFile *file, int number, const void *chunk, size_t bytes)
{
    SEL_REQUIRE(number >= 0 && number < file->set_count, "the dataset was added");
    Set *set = &file->set[number];
    uint64_t fan = (uint64_t)file->fan, leaf = set->chunks / fan, i = set->chunks % fan;
    hsize_t row = set->chunks * set->chunk_rows;
    SEL_ASSERT(bytes > 0, "a packed chunk has bytes");
    if (file->fault)
        return false;
    if (leaf == fan)
        return refuse(file, "the file's index is full");
    haddr_t address = take_space(file, bytes);
    if (address == 0 || !write_all(file->descriptor, chunk, bytes, address))
        return false;
    bool good = set->chunks == 0 ? make_index(file, set, bytes, address)
                : i == 0         ? add_leaf(file, set, leaf, bytes, row, address)
                                 : add_entry(file, set, set->leaf, 0, i, bytes, row, address, row + set->chunk_rows);
    set->chunks += good;
    return good;
}

void ordered_file_set_rows(OrderedFile *file, int number, hsize_t rows)
{
    SEL_REQUIRE(number >= 0 && number < file->set_count, "the dataset was added");
    const Set *set = &file->set[number];
    Page *page = page_of(file, set->extent);
    SEL_REQUIRE(page, "the extent's page was read when the dataset was added");
    SEL_ASSERT(rows <= set->chunks * set->chunk_rows, "the stated rows were appended");
    SEL_ASSERT(set->extent % ORDERED_FILE_PAGE + WORD <= ORDERED_FILE_PAGE, "an extent lies in one page");
    put_little_endian(page->wanted + set->extent % ORDERED_FILE_PAGE, rows, WORD);
}

static bool write_page(OrderedFile *file, Page *page)
{
    size_t first = 0, end = ORDERED_FILE_PAGE;
    while (first < end && page->wanted[first] == page->disk[first])
        first++;
    while (end > first && page->wanted[end - 1] == page->disk[end - 1])
        end--;
    if (first == end)
        return true;
    watch(false);
    memcpy(page->disk + first, page->wanted + first, end - first);
    // a single call, in case the system writes it in one piece; a partial write is completed
    return write_all(file->descriptor, page->wanted + first, end - first, page->start + first);
}

bool ordered_file_commit(OrderedFile *file)
{
    if (file->fault)
        return false;
    bool good = state_end(file, file->end + file->ahead);
    for (int i = 0; good && i < file->page_count; i++)
        good = write_page(file, &file->page[i]);
    watch(true);
    return good;
}

bool ordered_file_close(OrderedFile *file, bool is_whole)
{
    bool good = true;
    if (is_whole)
        good = write_word(file, file->end_field, file->end) && set_length(file->descriptor, file->end);
    if (file->descriptor >= 0)
        good &= close(file->descriptor) == 0;
    for (int i = 0; i < file->page_count; i++)
        free(file->page[i].disk);
    free(file->node);
    free(file);
    return good;
}
