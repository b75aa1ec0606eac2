// The header gives the rules. They assume that the library reads creation lists, links and types without reading data or opening other files.
#define ZLIB_CONST
#include "recon/hdf5_reader.h"

#include "base/base.h"
#include "recon/hdf5_silence.h"
#include "recon/hdf5_source.h"

#include <errno.h>
#include <fcntl.h>
#include <hdf5.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>

struct Hdf5Reader {
    Hdf5Source source;
    hid_t file;
    const char *name, *needs;
    Faults *faults;
    int faults_before;
    hsize_t left;            // [bytes] of the file not yet claimed by a dataset
    hsize_t left_unpacked;   // [bytes] of memory that compressed datasets may still take
    Hdf5Silence silence;
    unsigned plugins;        // the library's plug-in mask before opening; restored on close
};

enum { MOST_PATH = 256 };

// --- opening ---

// The library's clean-up at exit writes nothing, but can fail on the remains of a damaged file ("infinite loop closing library"), so it is switched off.
static void be_silent(Hdf5Reader *reader)
{
    H5dont_atexit();      // has an effect only before the library is initialised
    reader->silence = hdf5_silence_begin();
}

// --- trial read in a child process ---

// Limits the time of the child process, which runs library calls that may crash. A corrupted heap can also make it hang. The limit is long because a loaded
// machine takes seconds for milliseconds of work.
static void be_expendable(void) { process_be_expendable(5, 60); }

static herr_t look_at_attribute(hid_t object, const char *name, const H5A_info_t *info, void *context)
{
    (void)info, (void)context;
    hid_t attribute = H5Aopen(object, name, H5P_DEFAULT), type = H5Aget_type(attribute), space = H5Aget_space(attribute);
    H5Tget_size(type);
    H5Sget_simple_extent_npoints(space);
    H5Aget_storage_size(attribute);
    H5Sclose(space);
    H5Tclose(type);
    H5Aclose(attribute);
    return 0;
}

static herr_t look_at_object(hid_t file, const char *name, const H5O_info_t *info, void *context)
{
    (void)context;
    hid_t object = H5Oopen(file, name, H5P_DEFAULT);
    H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_NATIVE, NULL, look_at_attribute, NULL);
    if (info->type == H5O_TYPE_DATASET) {
        hsize_t chunks = 0;
        hid_t creation = H5Dget_create_plist(object), type = H5Dget_type(object), space = H5Dget_space(object);
        if (H5Pget_layout(creation) == H5D_CHUNKED)
            H5Dget_num_chunks(object, H5S_ALL, &chunks);
        H5Dget_storage_size(object);
        H5Sclose(space);
        H5Tclose(type);
        H5Pclose(creation);
    }
    H5Oclose(object);
    return 0;
}

// Returns true if the library (1.10) can read the file's structure without crashing: damaged sizes in headers without checksums make it overrun its memory. A
// child process therefore reads the whole structure first.
static bool is_survived(Hdf5Source *source)
{
    int status = 0;
    pid_t child = fork();
    if (child == 0) {
        be_expendable();
        hid_t file = hdf5_source_open(source);
        if (file >= 0) {
            H5Ovisit(file, H5_INDEX_NAME, H5_ITER_NATIVE, look_at_object, NULL);
            H5Fclose(file);
        }
        _exit(0);
    }
    while (child > 0 && waitpid(child, &status, 0) < 0 && errno == EINTR)
        continue;
    return child < 0 || (WIFEXITED(status) && WEXITSTATUS(status) == 0);      // if fork fails, there is no trial read
}

// Takes ownership of the source's file.
static Hdf5Reader *open_source(const Hdf5Source *source, bool has_rehearsal, const char *name, const char *needs, Faults *faults)
{
    if (!heap_can_allocate(HEAP_RESERVE_OF_HDF5))
        heap_is_empty(HEAP_RESERVE_OF_HDF5, __FILE__);
    Hdf5Reader *reader = HEAP_ZEROED(1, sizeof *reader);
    *reader = (Hdf5Reader){.source = *source,
                           .file = -1,
                           .name = name,
                           .needs = needs,
                           .faults = faults,
                           .faults_before = faults->count,
                           .left = source->length < HDF5_READER_MOST_BYTES ? source->length : HDF5_READER_MOST_BYTES,
                           .left_unpacked = source->length < HDF5_READER_MOST_BYTES / HDF5_READER_MOST_RATIO ? source->length * HDF5_READER_MOST_RATIO
                                                                                                             : HDF5_READER_MOST_BYTES};
    be_silent(reader);
    if (H5PLget_loading_state(&reader->plugins) < 0)
        reader->plugins = 0;
    H5PLset_loading_state(0);
    bool is_sound = !has_rehearsal || is_survived(&reader->source);
    reader->file = is_sound ? hdf5_source_open(&reader->source) : -1;
    if (reader->file >= 0)
        return reader;
    int reason = reader->source.reason;
    faults_add_at_byte(faults, name, 0, "is not a readable HDF5 file (truncated, damaged or of another kind); %s", needs);
    hdf5_reader_close(reader);
    errno = reason;
    return NULL;
}

Hdf5Reader *hdf5_reader_open(const char *path, const char *needs, Faults *faults)
{
    struct stat status;
    int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);     // do not block on a pipe
    int reason = file < 0 ? errno : 0;
    if (file < 0 || fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) {
        faults_add(faults, path, 0, 0, "cannot be opened as a regular file; %s", needs);
        if (file >= 0)
            close(file);
        errno = reason;
        return NULL;
    }
    return open_source(&(Hdf5Source){.file = file, .length = (size_t)status.st_size}, true, path, needs, faults);
}

Hdf5Reader *hdf5_reader_parse(const void *bytes, size_t length, bool has_rehearsal, const char *name, const char *needs, Faults *faults)
{
    return open_source(&(Hdf5Source){.file = -1, .bytes = bytes, .length = length}, has_rehearsal, name, needs, faults);
}

void hdf5_reader_close(Hdf5Reader *reader)
{
    if (!reader)
        return;
    if (reader->file >= 0)
        H5Fclose(reader->file);
    if (reader->source.file >= 0)
        close(reader->source.file);
    // after a failed read from disk, datasets only seemed missing or damaged
    if (reader->source.reason) {
        reader->faults->count = reader->faults_before;
        faults_add(reader->faults, reader->name, 0, 0, "cannot be read: %s", strerror(reader->source.reason));
    }
    H5PLset_loading_state(reader->plugins);
    hdf5_silence_end(reader->silence);
    free(reader);
}

// --- links ---

typedef enum { LINK_NONE, LINK_HARD, LINK_OTHER } LinkKind;

// Examines each link of the path before the library follows it.
static LinkKind link_kind(const Hdf5Reader *reader, const char *path)
{
    char part[MOST_PATH];
    size_t length = strlen(path);
    if (length >= sizeof part)
        return LINK_NONE;
    for (size_t end = 1; end <= length; end++) {
        if (path[end] != '/' && path[end] != '\0')
            continue;
        H5L_info_t link;
        memcpy(part, path, end);
        part[end] = '\0';
        if (H5Lexists(reader->file, part, H5P_DEFAULT) <= 0 || H5Lget_info(reader->file, part, &link, H5P_DEFAULT) < 0)
            return LINK_NONE;
        if (link.type != H5L_TYPE_HARD)
            return LINK_OTHER;
    }
    return LINK_HARD;
}

bool hdf5_has(const Hdf5Reader *reader, const char *path) { return link_kind(reader, path) != LINK_NONE; }

static hid_t open_dataset(const Hdf5Reader *reader, const char *path)
{
    LinkKind kind = link_kind(reader, path);
    hid_t set = kind == LINK_HARD ? H5Dopen2(reader->file, path, H5P_DEFAULT) : -1;
    if (kind == LINK_NONE)
        faults_add(reader->faults, reader->name, 0, 0, "has no dataset %s; %s", path, reader->needs);
    else if (kind == LINK_OTHER)
        faults_add(reader->faults, reader->name, 0, 0, "%s is a soft or external link; expected a dataset of this file", path);
    else if (set < 0)
        faults_add(reader->faults, reader->name, 0, 0, "%s cannot be opened; expected a dataset with an intact header", path);
    return set;
}

// --- types and shapes ---

static bool is_float(Hdf5Type type) { return type == HDF5_FLOAT || type == HDF5_DOUBLE; }

static hid_t memory_type(Hdf5Type type)
{
    switch (type) {
    case HDF5_INT8: return H5T_NATIVE_INT8;
    case HDF5_UINT8: return H5T_NATIVE_UINT8;
    case HDF5_INT32: return H5T_NATIVE_INT32;
    case HDF5_UINT32: return H5T_NATIVE_UINT32;
    case HDF5_INT64: return H5T_NATIVE_INT64;
    case HDF5_UINT64: return H5T_NATIVE_UINT64;
    case HDF5_FLOAT: return H5T_NATIVE_FLOAT;
    default: return H5T_NATIVE_DOUBLE;
    }
}

static bool is_one_of(hid_t type, const hid_t *standard, int count)
{
    bool found = false;
    for (int i = 0; i < count && !found; i++)
        found = H5Tequal(type, standard[i]) > 0;
    return found;
}

static bool is_plain_float(hid_t type)
{
    const hid_t standard[] = {H5T_IEEE_F64LE, H5T_IEEE_F64BE, H5T_IEEE_F32LE, H5T_IEEE_F32BE};
    return is_one_of(type, standard, 4);
}

static bool is_plain_integer(hid_t type)
{
    const hid_t standard[] = {H5T_STD_I8LE,  H5T_STD_U8LE,  H5T_STD_I8BE,  H5T_STD_U8BE,  H5T_STD_I16LE, H5T_STD_U16LE, H5T_STD_I16BE, H5T_STD_U16BE,
                              H5T_STD_I32LE, H5T_STD_U32LE, H5T_STD_I32BE, H5T_STD_U32BE, H5T_STD_I64LE, H5T_STD_U64LE, H5T_STD_I64BE, H5T_STD_U64BE};
    return is_one_of(type, standard, 16);
}

static void print_size(char text[80], int rank, const uint64_t *size)
{
    int used = 0;
    for (int i = 0; i < rank && used < 72; i++)
        used += size[i] ? snprintf(text + used, 80 - (size_t)used, "%s%" PRIu64, i ? ", " : "(", size[i])
                        : snprintf(text + used, 80 - (size_t)used, "%sany", i ? ", " : "(");
    snprintf(text + used, 80 - (size_t)used, ")");
}

// Stores the shape found in `dataset`. Returns false, with a fault, if it is not the expected one.
static bool has_shape(const Hdf5Reader *reader, hid_t space, Hdf5Dataset *dataset)
{
    hsize_t found[H5S_MAX_RANK] = {0};
    int rank = H5Sget_simple_extent_type(space) == H5S_SIMPLE ? H5Sget_simple_extent_dims(space, found, NULL) : -1;
    bool fits = rank == dataset->rank;
    for (int i = 0; fits && i < rank; i++)
        fits = dataset->size[i] == 0 || dataset->size[i] == found[i];
    if (!fits) {
        char valid[80], is[80] = "none";
        print_size(valid, dataset->rank, dataset->size);
        if (rank >= 0 && rank <= 3)
            print_size(is, rank, (const uint64_t[]){found[0], found[1], found[2]});
        faults_add(reader->faults, reader->name, 0, 0, "%s has the wrong shape %s; expected %s", dataset->path, is, valid);
        return false;
    }
    for (int i = 0; i < rank; i++)
        dataset->size[i] = found[i];
    return true;
}

// a b, or UINT64_MAX on overflow.
static uint64_t times(uint64_t a, uint64_t b) { return b > 0 && a > UINT64_MAX / b ? UINT64_MAX : a * b; }

static uint64_t value_count(const Hdf5Dataset *dataset)
{
    uint64_t values = 1;
    for (int i = 0; i < dataset->rank; i++)
        values = times(values, dataset->size[i]);
    return values;
}

// --- storage ---

static bool lies_in_file(const Hdf5Reader *reader, haddr_t address, hsize_t bytes)
{
    return address != HADDR_UNDEF && bytes <= reader->source.length && address <= reader->source.length - bytes;
}

// How a dataset's chunks are compressed: not at all, by deflate, or by shuffle followed by deflate.
typedef struct Packing {
    int filter_count;
    bool is_shuffled;
} Packing;

// Returns NULL, or what is wrong. The mask stored with each chunk has a bit for each filter that was skipped.
static const char *find_packing(hid_t creation, size_t value_bytes, Packing *packing)
{
    static const char *const other = "is compressed by filters other than deflate, or shuffle followed by deflate (`h5repack -f NONE IN OUT` decompresses it)";
    *packing = (Packing){.filter_count = H5Pget_nfilters(creation)};
    if (packing->filter_count < 0 || packing->filter_count > 2)
        return other;
    packing->is_shuffled = packing->filter_count == 2;
    for (int i = 0; i < packing->filter_count; i++) {
        unsigned flags, parameter[2] = {0}, config;
        size_t count = 2;
        H5Z_filter_t filter = H5Pget_filter2(creation, (unsigned)i, &flags, &count, parameter, 0, NULL, &config);
        bool is_last = i == packing->filter_count - 1;
        if (filter != (is_last ? H5Z_FILTER_DEFLATE : H5Z_FILTER_SHUFFLE) || count != 1 || (!is_last && parameter[0] != value_bytes))
            return other;
    }
    return NULL;
}

static const char huge[] = "has more or larger chunks than the file holds, or than the limits (262144, 16 GiB)";

// Sizes of a dataset, in values and bytes.
typedef struct Chunks {
    hsize_t size[3], bytes, count;       // size of a chunk [values], bytes of a chunk, number of chunks
} Chunks;

static const char *count_chunks(hid_t creation, const Hdf5Dataset *dataset, hsize_t value_bytes, Chunks *chunks)
{
    *chunks = (Chunks){.bytes = value_bytes, .count = 1};
    if (H5Pget_chunk(creation, 3, chunks->size) != dataset->rank)
        return "has chunks of a different rank";
    for (int i = 0; i < dataset->rank; i++) {
        if (chunks->size[i] == 0)
            return "has empty chunks";
        chunks->bytes = times(chunks->bytes, chunks->size[i]);
        chunks->count = times(chunks->count, (dataset->size[i] - 1) / chunks->size[i] + 1);
    }
    return chunks->count > HDF5_READER_MOST_CHUNKS ? huge : NULL;
}

static void next_chunk(const Chunks *chunks, const Hdf5Dataset *dataset, hsize_t at[3])
{
    for (int k = dataset->rank - 1; k >= 0 && (at[k] += chunks->size[k]) >= dataset->size[k]; k--)
        at[k] = 0;
}

// Most bytes that a stored chunk may have. Deflate hardly lengthens incompressible data, so a longer chunk is refused.
static hsize_t most_stored(const Chunks *chunks) { return chunks->bytes + chunks->bytes / 1000 + 100; }

// Checks that each chunk exists with all its bytes: the library allocates by the index and reads by the shape. Returns NULL, or what is wrong.
static const char *chunk_trouble(Hdf5Reader *reader, hid_t set, hid_t creation, const Hdf5Dataset *dataset, hsize_t value_bytes)
{
    hsize_t at[3] = {0}, all_stored = 0, wide = value_bytes > sizeof(double) ? value_bytes : sizeof(double);
    Packing packing;
    Chunks chunks;
    const char *trouble = find_packing(creation, value_bytes, &packing);
    trouble = trouble ? trouble : count_chunks(creation, dataset, value_bytes, &chunks);
    if (trouble)
        return trouble;
    bool is_packed = packing.filter_count > 0;
    hsize_t unpacked = times(times(chunks.bytes / value_bytes, chunks.count), wide);
    if (is_packed && (unpacked > reader->left_unpacked || chunks.bytes > UINT32_MAX))
        return "decompresses to more than 256 times the file's size, or to more than the limit (16 GiB)";
    if (!is_packed && times(chunks.bytes, chunks.count) > reader->left)
        return huge;
    for (hsize_t i = 0; i < chunks.count; i++) {
        hsize_t stored = 0;
        haddr_t address = HADDR_UNDEF;
        unsigned left_out = 0;
        if (H5Dget_chunk_info_by_coord(set, at, &left_out, &address, &stored) < 0 || address == HADDR_UNDEF)
            return "has chunks that were never written";
        if ((is_packed ? stored > most_stored(&chunks) : stored != chunks.bytes) || !lies_in_file(reader, address, stored))
            return "has truncated chunks";
        if ((all_stored += stored) > reader->left)
            return huge;
        next_chunk(&chunks, dataset, at);
    }
    reader->left -= all_stored;
    reader->left_unpacked -= is_packed ? unpacked : 0;
    return NULL;
}

static const char *contiguous_trouble(Hdf5Reader *reader, hid_t set, uint64_t bytes, bool is_compact)
{
    if (H5Dget_storage_size(set) != bytes)
        return "has fewer bytes than its shape needs";
    if (bytes > reader->left || (!is_compact && !lies_in_file(reader, H5Dget_offset(set), bytes)))
        return "has more bytes than the file, or than the limit (16 GiB)";
    reader->left -= bytes;
    return NULL;
}

// Returns NULL, or the reason why a dataset's bytes are not stored in this file in a supported layout.
static const char *storage_trouble(Hdf5Reader *reader, hid_t set, const Hdf5Dataset *dataset, size_t value_bytes)
{
    hid_t creation = H5Dget_create_plist(set);
    if (creation < 0)
        return "has no storage layout";
    uint64_t values = value_count(dataset);
    H5D_layout_t layout = H5Pget_layout(creation);
    const char *trouble = NULL;
    if (H5Pget_external_count(creation) != 0)
        trouble = "is stored in another file";
    else if (layout == H5D_VIRTUAL)
        trouble = "is a virtual dataset (assembled from other files)";
    else if (H5Pget_nfilters(creation) != 0 && layout != H5D_CHUNKED)
        trouble = "is compressed but not chunked";
    else if (values > 0 && layout == H5D_CHUNKED)
        trouble = chunk_trouble(reader, set, creation, dataset, value_bytes);
    else if (values > 0)
        trouble = contiguous_trouble(reader, set, times(values, value_bytes), layout == H5D_COMPACT);
    H5Pclose(creation);
    return trouble;
}

// --- datasets ---

static bool inspect_open(Hdf5Reader *reader, hid_t set, hid_t type, hid_t space, Hdf5Dataset *dataset)
{
    if (type < 0 || !(is_float(dataset->type) ? is_plain_float(type) : is_plain_integer(type))) {
        faults_add(reader->faults, reader->name, 0, 0, "%s has the wrong type; expected %s", dataset->path,
                   is_float(dataset->type) ? "IEEE floats of 32 or 64 bits" : "integers of 8 to 64 bits");
        return false;
    }
    if (space < 0 || !has_shape(reader, space, dataset))
        return false;
    const char *trouble = storage_trouble(reader, set, dataset, H5Tget_size(type));
    if (trouble)
        faults_add(reader->faults, reader->name, 0, 0, "%s promises %" PRIu64 " values, but %s; expected data in this file, plain or compressed by deflate",
                   dataset->path, value_count(dataset), trouble);
    return !trouble;
}

bool hdf5_inspect(Hdf5Reader *reader, Hdf5Dataset *dataset)
{
    hid_t set = open_dataset(reader, dataset->path);
    if (set < 0)
        return false;
    hid_t type = H5Dget_type(set), space = H5Dget_space(set);
    bool good = inspect_open(reader, set, type, space, dataset);
    if (space >= 0)
        H5Sclose(space);
    if (type >= 0)
        H5Tclose(type);
    H5Dclose(set);
    return good;
}

static bool is_finite(const Hdf5Reader *reader, const Hdf5Dataset *dataset, const void *values)
{
    uint64_t count = value_count(dataset);
    for (uint64_t i = 0; i < count; i++) {
        double value = dataset->type == HDF5_FLOAT ? (double)((const float *)values)[i] : ((const double *)values)[i];
        if (!isfinite(value)) {
            faults_add(reader->faults, reader->name, 0, 0, "%s holds %g in row %" PRIu64 "; expected finite numbers", dataset->path, value,
                       i / (count / dataset->size[0]));
            return false;
        }
    }
    return true;
}

// --- decompression ---

// Inflates to exactly `bytes` bytes. We call zlib ourselves, because the library's filter trusts the stream. Returns false if the stream yields fewer or more
// bytes, or has trailing data.
static bool inflate_exactly(const void *packed, size_t packed_bytes, unsigned char *out, size_t bytes)
{
    unsigned char beyond;
    z_stream stream = {.next_in = packed, .avail_in = (uInt)packed_bytes, .next_out = out, .avail_out = (uInt)bytes};
    if (inflateInit(&stream) != Z_OK)
        return false;
    int end = inflate(&stream, Z_FINISH);
    if (end == Z_BUF_ERROR && stream.avail_out == 0) {        // all expected bytes are there; one more byte of space shows whether the stream ends here
        stream.next_out = &beyond;
        stream.avail_out = 1;
        end = inflate(&stream, Z_FINISH);
    }
    bool good = end == Z_STREAM_END && stream.total_out == bytes && stream.avail_in == 0;
    inflateEnd(&stream);
    return good;
}

// Undoes `shuffle`: the input holds the first bytes of all `count` values, then all second bytes, and so on.
static void unshuffle(const unsigned char *from, size_t count, size_t value_bytes, unsigned char *to)
{
    for (size_t byte = 0; byte < value_bytes; byte++)
        for (size_t i = 0; i < count; i++)
            to[i * value_bytes + byte] = from[byte * count + i];
}

// Copies a chunk's values to their place in the dataset; chunks at its ends are clipped. Missing dimensions count as 1.
static void place_chunk(const Hdf5Dataset *dataset, const Chunks *chunks, const hsize_t at[3], size_t value_bytes, const unsigned char *chunk,
                        unsigned char *out)
{
    hsize_t size[3] = {1, 1, 1}, part[3] = {1, 1, 1}, used[3], first[3] = {0};
    for (int i = 0; i < dataset->rank; i++) {
        int k = 3 - dataset->rank + i;
        size[k] = dataset->size[i];
        part[k] = chunks->size[i];
        first[k] = at[i];
    }
    for (int k = 0; k < 3; k++)
        used[k] = size[k] - first[k] < part[k] ? size[k] - first[k] : part[k];
    for (hsize_t i = 0; i < used[0]; i++)
        for (hsize_t j = 0; j < used[1]; j++)
            memcpy(out + (((first[0] + i) * size[1] + first[1] + j) * size[2] + first[2]) * value_bytes, chunk + (i * part[1] + j) * part[2] * value_bytes,
                   used[2] * value_bytes);
}

// Buffers of one chunk: as stored, inflated, unshuffled.
typedef struct Unpacking {
    Packing packing;
    Chunks chunks;
    size_t value_bytes;
    unsigned char *stored, *shuffled, *plain;
} Unpacking;

// Reads and decompresses the chunk that begins at value `at`. Returns false if it is damaged.
static bool unpack_chunk(const Unpacking *u, hid_t set, const hsize_t at[3])
{
    const unsigned deflated = 1U << (u->packing.filter_count - 1);
    uint32_t left_out = 0;
    hsize_t stored = 0;
    if (H5Dget_chunk_storage_size(set, at, &stored) < 0 || stored > most_stored(&u->chunks) || H5Dread_chunk(set, H5P_DEFAULT, at, &left_out, u->stored) < 0)
        return false;
    bool is_shuffled = u->packing.is_shuffled && !(left_out & 1);
    unsigned char *inflated = is_shuffled ? u->shuffled : u->plain;
    bool is_plain = left_out & deflated;
    if (is_plain && stored == u->chunks.bytes)
        memcpy(inflated, u->stored, stored);
    else if (is_plain || !inflate_exactly(u->stored, stored, inflated, u->chunks.bytes))
        return false;
    if (is_shuffled)
        unshuffle(u->shuffled, u->chunks.bytes / u->value_bytes, u->value_bytes, u->plain);
    return true;
}

static bool unpack_all(Unpacking *u, hid_t set, const Hdf5Dataset *dataset, unsigned char *out)
{
    hsize_t at[3] = {0};
    u->stored = malloc(most_stored(&u->chunks));
    u->shuffled = malloc(u->chunks.bytes);
    u->plain = malloc(u->chunks.bytes);
    bool good = u->stored && u->shuffled && u->plain;
    for (hsize_t i = 0; good && i < u->chunks.count; i++) {
        good = unpack_chunk(u, set, at);
        if (good)
            place_chunk(dataset, &u->chunks, at, u->value_bytes, u->plain, out);
        next_chunk(&u->chunks, dataset, at);
    }
    free(u->stored);
    free(u->shuffled);
    free(u->plain);
    return good;
}

// Reads all chunks of a compressed dataset and converts the values in place to the requested type.
static bool read_packed(hid_t set, hid_t creation, const Hdf5Dataset *dataset, void *out)
{
    hid_t type = H5Dget_type(set), wanted = memory_type(dataset->type);
    uint64_t values = value_count(dataset);
    size_t from = H5Tget_size(type), to = H5Tget_size(wanted);
    Unpacking u = {.value_bytes = from};
    bool good = !find_packing(creation, from, &u.packing) && !count_chunks(creation, dataset, from, &u.chunks);
    void *stage = good && from > to ? malloc(values * from) : out;
    good = good && stage && unpack_all(&u, set, dataset, stage) && H5Tconvert(type, wanted, values, stage, NULL, H5P_DEFAULT) >= 0;
    if (good && stage != out)
        memcpy(out, stage, values * to);
    if (stage != out)
        free(stage);
    H5Tclose(type);
    return good;
}

static bool read_values(hid_t set, const Hdf5Dataset *dataset, void *out)
{
    hid_t creation = H5Dget_create_plist(set);
    bool is_packed = creation >= 0 && H5Pget_nfilters(creation) != 0;
    bool good = creation >= 0 &&
                (is_packed ? read_packed(set, creation, dataset, out) : H5Dread(set, memory_type(dataset->type), H5S_ALL, H5S_ALL, H5P_DEFAULT, out) >= 0);
    if (creation >= 0)
        H5Pclose(creation);
    return good;
}

bool hdf5_read_into(Hdf5Reader *reader, const Hdf5Dataset *dataset, void *out)
{
    uint64_t values = value_count(dataset);
    hid_t set = H5Dopen2(reader->file, dataset->path, H5P_DEFAULT);
    bool good = set >= 0 && (values == 0 || read_values(set, dataset, out));
    if (set >= 0)
        H5Dclose(set);
    if (!good)
        faults_add(reader->faults, reader->name, 0, 0, "%s cannot be read: its data are damaged or truncated", dataset->path);
    return good && (!dataset->is_finite || !is_float(dataset->type) || is_finite(reader, dataset, out));
}

void *hdf5_read(Hdf5Reader *reader, Hdf5Dataset *dataset)
{
    if (!hdf5_inspect(reader, dataset))
        return NULL;
    void *values = calloc(value_count(dataset) + 1, H5Tget_size(memory_type(dataset->type)));
    if (!values)
        faults_add(reader->faults, reader->name, 0, 0, "not enough memory for %s (%" PRIu64 " values)", dataset->path, value_count(dataset));
    else if (hdf5_read_into(reader, dataset, values))
        return values;
    free(values);
    return NULL;
}

// --- strings and numbers ---

static bool is_one_text(hid_t type, hid_t space)
{
    return H5Tget_class(type) == H5T_STRING && H5Sget_simple_extent_npoints(space) == 1 &&
           (H5Tis_variable_str(type) > 0 || H5Tget_size(type) <= HDF5_READER_MOST_TEXT);
}

static char *fixed_text(const Hdf5Reader *reader, hid_t type, hid_t set, hid_t attribute)
{
    size_t size = H5Tget_size(type);
    char *text = size <= reader->source.length ? HEAP_ZEROED(size + 1, 1) : NULL;
    if (text && (set >= 0 ? H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text) : H5Aread(attribute, type, text)) >= 0)
        return text;
    free(text);
    return NULL;
}

// Runs in the child process: writes the string that the library reads into the pipe. A zero byte marks the end.
static _Noreturn void send_variable_text(hid_t type, hid_t attribute, int end)
{
    char *text = NULL;
    be_expendable();
    size_t length = H5Aread(attribute, type, &text) >= 0 && text ? strlen(text) + 1 : 0;
    for (ssize_t sent; length > 0 && (sent = write(end, text, length)) > 0; length -= (size_t)sent)
        text += sent;
    _exit(0);
}

static char *receive_text(int end)
{
    size_t capacity = 1 << 12, length = 0;
    char *text = HEAP_ZEROED(capacity, 1);
    for (ssize_t got; (got = read(end, text + length, capacity - length)) > 0 || (got < 0 && errno == EINTR);) {
        length += got > 0 ? (size_t)got : 0;
        if (length == capacity && capacity < HDF5_READER_MOST_TEXT)
            text = HEAP_GROWN(text, capacity *= 2, 1);
    }
    if (length > 0 && text[length - 1] == '\0')
        return text;
    free(text);
    return NULL;
}

// Reads a string of variable length, as h5py writes it. Its heap has no checksum, and wrong sizes there make the library (1.10) write beyond its memory, so a
// child process reads it.
static char *variable_text(hid_t type, hid_t attribute)
{
    int ends[2];
    if (pipe(ends) != 0)
        return NULL;
    pid_t child = fork();
    if (child == 0)
        send_variable_text(type, attribute, ends[1]);
    close(ends[1]);
    char *text = child > 0 ? receive_text(ends[0]) : NULL;
    close(ends[0]);
    while (child > 0 && waitpid(child, NULL, 0) < 0 && errno == EINTR)
        continue;
    return text;
}

char *hdf5_text(Hdf5Reader *reader, const char *path)
{
    hid_t set = hdf5_has(reader, path) ? open_dataset(reader, path) : -1;
    if (set < 0)
        return NULL;
    hid_t type = H5Dget_type(set), space = H5Dget_space(set);
    char *text = NULL;
    if (type >= 0 && space >= 0 && is_one_text(type, space) && H5Tis_variable_str(type) <= 0 &&
        !storage_trouble(reader, set, &(Hdf5Dataset){.path = path, .rank = 0}, H5Tget_size(type)))
        text = fixed_text(reader, type, set, -1);
    if (!text)
        faults_add(reader->faults, reader->name, 0, 0, "%s is not a string; expected one string of fixed length, stored in this file", path);
    if (space >= 0)
        H5Sclose(space);
    if (type >= 0)
        H5Tclose(type);
    H5Dclose(set);
    return text;
}

// Returns -1 if there is no such attribute.
static hid_t open_attribute(const Hdf5Reader *reader, const char *object, const char *name)
{
    bool is_here = strcmp(object, "/") == 0 || link_kind(reader, object) == LINK_HARD;
    if (!is_here || H5Aexists_by_name(reader->file, object, name, H5P_DEFAULT) <= 0)
        return -1;
    return H5Aopen_by_name(reader->file, object, name, H5P_DEFAULT, H5P_DEFAULT);
}

char *hdf5_text_attribute(Hdf5Reader *reader, const char *object, const char *name)
{
    hid_t attribute = open_attribute(reader, object, name);
    if (attribute < 0)
        return NULL;
    hid_t type = H5Aget_type(attribute), space = H5Aget_space(attribute);
    char *text = NULL;
    if (type >= 0 && space >= 0 && is_one_text(type, space))
        text = H5Tis_variable_str(type) > 0 ? variable_text(type, attribute) : fixed_text(reader, type, -1, attribute);
    if (!text)
        faults_add(reader->faults, reader->name, 0, 0, "attribute %s of %s is not a string; expected one string", name, object);
    if (space >= 0)
        H5Sclose(space);
    if (type >= 0)
        H5Tclose(type);
    H5Aclose(attribute);
    return text;
}

double hdf5_number(Hdf5Reader *reader, const char *name, double otherwise)
{
    hid_t attribute = open_attribute(reader, "/", name);
    if (attribute < 0)
        return otherwise;
    double value = NAN;
    hid_t type = H5Aget_type(attribute), space = H5Aget_space(attribute);
    bool is_number = type >= 0 && space >= 0 && (is_plain_float(type) || is_plain_integer(type)) && H5Sget_simple_extent_npoints(space) == 1;
    if (!is_number || H5Aread(attribute, H5T_NATIVE_DOUBLE, &value) < 0) {
        faults_add(reader->faults, reader->name, 0, 0, "attribute %s is not a number; expected one number", name);
        value = otherwise;
    }
    if (space >= 0)
        H5Sclose(space);
    if (type >= 0)
        H5Tclose(type);
    H5Aclose(attribute);
    return value;
}
