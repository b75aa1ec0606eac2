// Selects the reader by content, lists the files of which a volume consists, and writes NRRD.
#include "recon/volume/volume_file.h"

#include "base/base.h"
#include "recon/volume/volume_dicom.h"
#include "recon/volume/volume_metaimage.h"
#include "recon/volume/volume_nifti.h"
#include "recon/volume/volume_nrrd.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

// --- the files of a volume ---

typedef void FileCall(void *context, const char *path);

// Calls for the file that an option such as `data file: NAME` gives, in the header's folder.
static void call_beside(const char *header_path, const char *name, size_t length, FileCall *call, void *context)
{
    char path[4096];
    const char *slash = strrchr(header_path, '/');
    while (length > 0 && isspace((unsigned char)*name))
        name++, length--;
    while (length > 0 && isspace((unsigned char)name[length - 1]))
        length--;
    int wrote = snprintf(path, sizeof path, "%.*s%.*s", slash ? (int)(slash - header_path) + 1 : 0, header_path, length < 1024 ? (int)length : 1024, name);
    if (length > 0 && wrote > 0 && wrote < (int)sizeof path)
        call(context, path);
}

typedef struct Named {       // context: calls for each name that a header gives, in the header's folder
    const char *header_path;
    FileCall *call;
    void *context;
} Named;

static void call_one(void *context, const char *name, size_t length)
{
    const Named *named = context;
    call_beside(named->header_path, name, length, named->call, named->context);
}

static void call_named(const char *header_path, const char *text, size_t length, LineCursor names, FileCall *call, void *context)
{
    Named named = {header_path, call, context};
    if (data_names_several(text, length))
        data_names_each(text, length, names, call_one, &named);
    else
        call_beside(header_path, text, length, call, context);
}

static void call_folder(const char *folder, FileCall *call, void *context)
{
    DIR *directory = opendir(folder);
    char path[4096];
    for (struct dirent *entry; directory && (entry = readdir(directory));)
        if (entry->d_name[0] != '.' && snprintf(path, sizeof path, "%s/%s", folder, entry->d_name) < (int)sizeof path)
            call(context, path);
    if (directory)
        closedir(directory);
}

// Calls for the header and the samples of a NIfTI pair, whichever of the two was given.
static void call_pair(const char *path, FileCall *call, void *context)
{
    static const char *const endings[] = {".hdr", ".img", ".hdr.gz", ".img.gz"};
    size_t n = strlen(path), stem = n > 3 && !strcmp(path + n - 3, ".gz") ? n - 3 : n;
    char other[4096];
    if (stem < 5 || (memcmp(path + stem - 4, ".hdr", 4) && memcmp(path + stem - 4, ".img", 4)))
        return;
    for (size_t i = 0; i < sizeof endings / sizeof *endings; i++)
        if (snprintf(other, sizeof other, "%.*s%s", (int)(stem - 4), path, endings[i]) < (int)sizeof other)
            call(context, other);
}

static void call_header(const FileBytes *file, FileCall *call, void *context)
{
    bool is_nrrd = volume_is_nrrd(file);
    LineCursor cursor = {file->byte, file->length, 0, 0};
    const char *text;
    size_t length;
    while (line_cursor_next(&cursor, &text, &length) && length > 0) {
        const char *sign = memchr(text, is_nrrd ? ':' : '=', length);
        size_t named = sign ? (size_t)(sign - text) : 0;
        bool is_key =
            is_nrrd ? header_text_is(text, named, "data file") || header_text_is(text, named, "datafile") : header_text_is(text, named, "ElementDataFile");
        if (sign && is_key) {
            call_named(file->path, sign + 1, length - named - 1, cursor, call, context);
            return;
        }
    }
}

void volume_each_data_file(const char *path, FileCall *call, void *context)
{
    struct stat status;
    const char *why;
    if (stat(path, &status) == 0 && S_ISDIR(status.st_mode)) {
        call_folder(path, call, context);
        return;
    }
    call_pair(path, call, context);
    int descriptor = regular_file_open(path, &status, &why);
    uint8_t *byte = descriptor >= 0 ? malloc(VOLUME_HEADER_MOST) : NULL;
    size_t length = byte ? regular_file_read(descriptor, byte, VOLUME_HEADER_MOST) : 0;
    if (descriptor >= 0)
        close(descriptor);
    const FileBytes file = {.byte = byte, .length = length, .path = path};
    if (byte && (volume_is_nrrd(&file) || volume_is_metaimage(&file))) {
        call_header(&file, call, context);
    } else if (byte && volume_is_dicom(&file)) {
        char folder[4096];
        const char *slash = strrchr(path, '/');
        snprintf(folder, sizeof folder, "%.*s", slash ? (int)(slash - path) : 1, slash ? path : ".");
        call_folder(folder[0] ? folder : "/", call, context);
    }
    free(byte);
}

// --- the choice of the reader ---

static bool names_samples_of_pair(const char *path)
{
    size_t n = strlen(path);
    return n > 4 && !strcmp(path + n - 4, ".img");
}

bool volume_is_known(const void *bytes, size_t length, const char *path)
{
    FileBytes file = {.byte = bytes, .length = length, .path = path};
    return volume_is_nrrd(&file) || volume_is_nifti(&file) || volume_is_metaimage(&file) || volume_is_dicom(&file) || names_samples_of_pair(path);
}

static Volume *parse(const FileBytes *file, Faults *faults)
{
    if (volume_is_nrrd(file))
        return volume_parse_nrrd(file, faults);
    if (volume_is_nifti(file))
        return volume_parse_nifti(file, faults);
    if (volume_is_metaimage(file))
        return volume_parse_metaimage(file, faults);
    if (volume_is_dicom(file))
        return volume_parse_dicom(file, faults);
    faults_add_at_byte(faults, file->path, 0,
                       "is not a supported volume format; expected NRRD (.nrrd .nhdr), MetaImage (.mha .mhd), NIfTI (.nii .nii.gz .hdr) or DICOM");
    return NULL;
}

Volume *volume_parse(const void *bytes, size_t length, const char *path, Faults *faults)
{
    const FileBytes file = {.byte = bytes, .length = length, .path = path};
    return parse(&file, faults);
}

// Reads a file, but no more of it than its header implies. A DICOM file is read completely: its headers extend through the whole file.
static bool read_promised(const char *path, FileBytes *out, Faults *faults)
{
    if (!file_bytes_read(path, VOLUME_HEADER_MOST, out, faults))
        return false;
    if (out->length == out->whole)
        return true;
    Faults ignored;
    FileBytes head = *out;
    size_t needed = 0;
    head.needed = &needed;
    faults_clear(&ignored);
    bool is_dicom = volume_is_dicom(&head) && !volume_is_nrrd(&head) && !volume_is_nifti(&head) && !volume_is_metaimage(&head);
    if (!is_dicom)
        parse(&head, &ignored);
    if (!is_dicom && needed == 0)   // a detached or invalid header: the fault is reported below
        return true;
    file_bytes_free(out);
    return is_dicom ? dicom_bytes_read(path, out, faults) : file_bytes_read(path, needed, out, faults);
}

Volume *volume_load(const char *path, Faults *faults)
{
    FileBytes file;
    struct stat status;
    if (!stat(path, &status) && S_ISDIR(status.st_mode))
        return volume_load_dicom_folder(path, faults);
    if (!read_promised(path, &file, faults))
        return NULL;
    size_t n = strlen(path);
    char header[4096];
    // the path may name the samples of a NIfTI pair: its header decides
    bool pair = names_samples_of_pair(path) && n < sizeof header && !volume_is_nrrd(&file) && !volume_is_nifti(&file);
    if (pair) {
        memcpy(header, path, n - 3);
        memcpy(header + n - 3, "hdr", 4);
        FileBytes other;
        if (!access(header, R_OK) && file_bytes_read(header, VOLUME_HEADER_MOST, &other, faults)) {
            file_bytes_free(&file);
            file = other;
            path = header;
        }
    }
    Volume *volume = parse(&file, faults);
    file_bytes_free(&file);
    return volume;
}

Volume *volume_load_with(const char *path, const Progress *progress, Faults *faults)
{
    volume_watch(progress);
    Volume *volume = volume_load(path, faults);
    volume_watch(NULL);
    return volume;
}

// --- NRRD output ---

static const struct SaveType {
    const char *name;
    size_t size;
    double least, most;
} save_types[] = {{"float", 4, 0, 0}, {"uint8", 1, 0, 255}, {"int16", 2, -32768, 32767}};

// Encodes the voxels as little-endian samples. Returns NULL with a fault if a value does not fit the type.
static uint8_t *encode_samples(const Volume *volume, size_t count, const struct SaveType *type, const char *path, Faults *faults)
{
    uint8_t *out = malloc(count * type->size);
    if (!out) {
        faults_add(faults, path, 0, 0, "needs %zu bytes of memory, more than is available", count * type->size);
        return NULL;
    }
    for (size_t i = 0; i < count; i++) {
        float x = volume->value[i];
        uint32_t bits;
        if (type->size == 4) {
            memcpy(&bits, &x, 4);
        } else {
            double whole = nearbyint(x);
            if (!(whole >= type->least && whole <= type->most)) {
                faults_add(faults, path, 0, 0, "voxel %zu has the value %g, which %s cannot hold; save as float", i, (double)x, type->name);
                free(out);
                return NULL;
            }
            bits = (uint32_t)(int32_t)whole;
        }
        for (size_t b = 0; b < type->size; b++)
            out[i * type->size + b] = (uint8_t)(bits >> (8 * b));
    }
    return out;
}

static bool write_gzip(FILE *file, const uint8_t *byte, size_t length)
{
    z_stream stream = {0};
    uint8_t buffer[1 << 15];
    const size_t chunk = (size_t)1 << 28;
    if (deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK)
        return false;
    bool good = true;
    for (size_t done = 0; good && done < length;) {
        size_t give = length - done < chunk ? length - done : chunk;
        stream.next_in = (Bytef *)(uintptr_t)(byte + done);
        stream.avail_in = (uInt)give;
        done += give;
        int flush = done == length ? Z_FINISH : Z_NO_FLUSH;
        do {
            stream.next_out = buffer;
            stream.avail_out = sizeof buffer;
            deflate(&stream, flush);
            size_t made = sizeof buffer - stream.avail_out;
            good = fwrite(buffer, 1, made, file) == made;
        } while (good && stream.avail_out == 0);
    }
    deflateEnd(&stream);
    return good;
}

bool volume_save_nrrd(const Volume *volume, const char *path, const char *type_name, Faults *faults)
{
    const struct SaveType *type = NULL;
    for (size_t i = 0; i < sizeof save_types / sizeof save_types[0]; i++)
        if (!strcmp(save_types[i].name, type_name))
            type = &save_types[i];
    if (!type) {
        faults_add(faults, path, 0, 0, "unknown sample type '%s'; expected float, uint8 or int16", type_name);
        return false;
    }
    if (part_file_is_through(path)) {
        faults_add(faults, path, 0, 0, "exists and is not a regular file; give another name");
        return false;
    }
    size_t count = (size_t)volume->size[0] * (size_t)volume->size[1] * (size_t)volume->size[2];
    uint8_t *sample = encode_samples(volume, count, type, path, faults);
    if (!sample)
        return false;
    PartFile part;
    bool good = part_file_begin(&part, path);
    FILE *file = good ? part_file_stream(&part) : NULL;
    if (file) {
        const Vec3 *a = volume->axis, o = volume->origin;
        fprintf(file, "NRRD0004\ntype: %s\ndimension: 3\n", type->name);
        if (volume->frame[0])
            fprintf(file, "space: %s\n", volume->frame);
        else
            fprintf(file, "space dimension: 3\n");
        fprintf(file, "sizes: %d %d %d\nspace directions:", volume->size[0], volume->size[1], volume->size[2]);
        for (int i = 0; i < 3; i++)
            fprintf(file, " (%.17g,%.17g,%.17g)", a[i].x, a[i].y, a[i].z);
        fprintf(file, "\nkinds: domain domain domain\nendian: little\nencoding: gzip\nspace origin: (%.17g,%.17g,%.17g)\n\n", o.x, o.y, o.z);
        good = write_gzip(file, sample, count * type->size) && part_file_finish_synced(&part);
    }
    int reason = errno;
    part_file_drop(&part);
    free(sample);
    good = good && file;
    if (!good)
        faults_add(faults, path, 0, 0, "cannot be written: %s; expected a writable folder with free space", strerror(reason));
    return good;
}
