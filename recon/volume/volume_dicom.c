// Reads DICOM (PS3.5 encoding, PS3.3 C.7.6 image modules): a series of single-frame files, or one multi-frame file with a position for each frame (enhanced
// CT, MR, XA 3D). Implicit and explicit little endian, explicit big endian; with or without the preamble. Compressed pixels are decoded by a separate
// program, seldinger-dicom (volume_dicom_pixels.h); the geometry is read here.
//
// Voxel (i, j) of slice k lies at ImagePositionPatient_k + i dx u + j dy v, where ImageOrientationPatient = (u, v) and PixelSpacing = (dy, dx).
// Slices are sorted by position along u x v; their spacing comes from the positions (SliceThickness is not the spacing), so that a tilted gantry
// gives sheared axes. DICOM prescribes the frame LPS. value = slope sample + intercept, both given for each slice; MONOCHROME1 displays small samples as
// bright: its samples are first inverted within their range.
//
// Reads in two passes: the headers of all files of the folder, then the samples file by file, so that only one file is in memory beside the volume.
#include "recon/volume/volume_dicom.h"

#include "base/base.h"
#include "recon/volume/volume_dicom_pixels.h"

#include <ctype.h>
#include <dirent.h>
#include <stdio.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

// largest file: the length of the pixels is a 32-bit number
#define DICOM_BYTES_MOST (((size_t)1 << 32) + ((size_t)1 << 26))

enum { PREAMBLE = 128, UID_CAPACITY = 68, MAX_DEPTH = 24 };
#define UNDEFINED_LENGTH 0xffffffffu
#define TAG(GROUP, ELEMENT) ((uint32_t)(GROUP) << 16 | (ELEMENT))

enum Tag {
    T_TRANSFER_SYNTAX = TAG(0x0002, 0x0010),
    T_SOP = TAG(0x0008, 0x0018),
    T_MODALITY = TAG(0x0008, 0x0060),
    T_DESCRIPTION = TAG(0x0008, 0x103e),
    T_SERIES = TAG(0x0020, 0x000e),
    T_POSITION = TAG(0x0020, 0x0032),
    T_ORIENTATION = TAG(0x0020, 0x0037),
    T_PLANE_POSITION = TAG(0x0020, 0x9113),
    T_PLANE_ORIENTATION = TAG(0x0020, 0x9116),
    T_SAMPLES = TAG(0x0028, 0x0002),
    T_PHOTOMETRIC = TAG(0x0028, 0x0004),
    T_FRAMES = TAG(0x0028, 0x0008),
    T_ROWS = TAG(0x0028, 0x0010),
    T_COLUMNS = TAG(0x0028, 0x0011),
    T_SPACING = TAG(0x0028, 0x0030),
    T_ALLOCATED = TAG(0x0028, 0x0100),
    T_STORED = TAG(0x0028, 0x0101),
    T_HIGH_BIT = TAG(0x0028, 0x0102),
    T_SIGNED = TAG(0x0028, 0x0103),
    T_INTERCEPT = TAG(0x0028, 0x1052),
    T_SLOPE = TAG(0x0028, 0x1053),
    T_MEASURES = TAG(0x0028, 0x9110),
    T_TRANSFORMATION = TAG(0x0028, 0x9145),
    T_SHARED = TAG(0x5200, 0x9229)
};
// macros, because an enumerator must be within the range of int
#define T_PER_FRAME TAG(0x5200u, 0x9230)
#define T_PIXELS TAG(0x7fe0u, 0x0010)
#define T_ITEM TAG(0xfffeu, 0xe000)
#define T_ITEM_END TAG(0xfffeu, 0xe00d)
#define T_SEQUENCE_END TAG(0xfffeu, 0xe0dd)

// Position and scaling of a slice: given for the file, for all frames, or for each frame.
typedef struct Plane {
    bool has_position, has_orientation, has_spacing, has_slope, has_intercept;
    double position[3], orientation[6], spacing[2], slope, intercept;
} Plane;

typedef struct DicomImage {
    char series[UID_CAPACITY], sop[UID_CAPACITY], syntax[UID_CAPACITY], modality[20], description[UID_CAPACITY], photometric[20];
    long rows, columns, allocated, stored, high_bit, is_signed, samples, frames;
    Plane file, shared, *frame;
    int frame_count, frame_capacity;
    bool is_walked;          // read completely, or up to the pixels
    bool has_pixels, is_encapsulated, big_endian, is_words;
    size_t pixel_place, pixel_length;
} DicomImage;

typedef struct Cursor {
    const uint8_t *byte;
    size_t length, at, offset;   // [bytes]; offset: position of byte[0] in the file, for messages
    bool explicit_vr, big_endian;
    const char *path;
    Faults *faults;
} Cursor;

typedef struct Element {
    uint32_t tag, length;
    char vr[3];
    size_t place;            // [bytes] position of the tag
} Element;

// The enclosing sequence; values of other sequences do not belong to the image.
typedef enum Scope { SCOPE_FILE, SCOPE_SHARED, SCOPE_PER_FRAME, SCOPE_OTHER } Scope;

// --- elements ---

static uint32_t bits_at(const Cursor *c, size_t at, int size)
{
    uint32_t bits = 0;
    for (int i = 0; i < size; i++)
        bits |= (uint32_t)c->byte[at + (size_t)(c->big_endian ? size - 1 - i : i)] << (8 * i);
    return bits;
}

static bool has_long_length(const char *vr)
{
    static const char names[][3] = {"OB", "OD", "OF", "OL", "OV", "OW", "SQ", "SV", "UC", "UN", "UR", "UT", "UV"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (!memcmp(vr, names[i], 2))
            return true;
    return false;
}

static bool fail(const Cursor *c, size_t at, const char *what)
{
    faults_add_at_byte(c->faults, c->path, c->offset + at, "%s", what);
    return false;
}

// Reads the next element's header. The cursor then points at its value, which lies within `end` if its length is defined (top-level pixels may be truncated:
// the missing part is reported later, as missing pixels).
static bool take_element(Cursor *c, size_t end, bool is_top, Element *e)
{
    static const char cut[] = "the file ends within an element; expected the whole file";
    e->place = c->at;
    if (end - c->at < 8)
        return fail(c, c->at, cut);
    e->tag = bits_at(c, c->at, 2) << 16 | bits_at(c, c->at + 2, 2);
    memset(e->vr, 0, sizeof e->vr);
    bool is_delimiter = e->tag >> 16 == 0xfffe, may_be_cut = is_top && e->tag == T_PIXELS;
    if (!c->explicit_vr || is_delimiter) {
        e->length = bits_at(c, c->at + 4, 4);
        c->at += 8;
    } else {
        memcpy(e->vr, c->byte + c->at + 4, 2);
        if (!isupper((unsigned char)e->vr[0]) || !isupper((unsigned char)e->vr[1]))
            return fail(c, c->at + 4, "a value representation (VR) is missing; expected a DICOM file in the encoding that its header names");
        if (has_long_length(e->vr)) {
            if (end - c->at < 12)
                return fail(c, c->at, cut);
            e->length = bits_at(c, c->at + 8, 4);
            c->at += 12;
        } else {
            e->length = bits_at(c, c->at + 6, 2);
            c->at += 8;
        }
    }
    if (e->length != UNDEFINED_LENGTH && e->length > end - c->at && !may_be_cut) {
        faults_add_at_byte(c->faults, c->path, c->offset + e->place,
                           "the element (%04x,%04x) has a length of %u bytes, but %zu are left; expected the whole file", e->tag >> 16, e->tag & 0xffff,
                           e->length, end - c->at);
        return false;
    }
    return true;
}

static void take_text(const Cursor *c, const Element *e, char *out, size_t capacity)
{
    size_t n = e->length < capacity - 1 ? e->length : capacity - 1;
    memcpy(out, c->byte + c->at, n);
    while (n > 0 && (out[n - 1] == 0 || out[n - 1] == ' '))
        n--;
    out[n] = 0;
    for (size_t i = 0; i < n; i++)
        if (!isprint((unsigned char)out[i]))
            out[i] = '?';
}

// Reads `count` decimal strings, separated by backslashes. An empty value counts as absent.
static bool take_decimals(const Cursor *c, const Element *e, int count, double *out, bool *has)
{
    char text[512];
    double value[6];
    size_t n = e->length;
    bool is_empty = true;
    for (size_t i = 0; i < n && i < sizeof text; i++) {
        char x = (char)c->byte[c->at + i];
        text[i] = x == '\\' || x == 0 ? ' ' : x;
        is_empty = is_empty && text[i] == ' ';
    }
    if (n <= sizeof text && is_empty)
        return true;
    bool good = n <= sizeof text && header_numbers(text, n, count, value);
    for (int i = 0; good && i < count; i++)
        good = isfinite(value[i]);
    if (!good) {
        faults_add_at_byte(c->faults, c->path, c->offset + c->at, "the element (%04x,%04x) is not valid; expected %d numbers, separated by \\", e->tag >> 16,
                           e->tag & 0xffff, count);
        return false;
    }
    memcpy(out, value, (size_t)count * sizeof *out);
    *has = true;
    return true;
}

static bool take_short(const Cursor *c, const Element *e, long *out)
{
    if (e->length != 2)
        return fail(c, c->at, "a whole number does not have two bytes; expected an intact image header");
    *out = (long)bits_at(c, c->at, 2);
    return true;
}

static bool take_plane(const Cursor *c, const Element *e, Plane *p)
{
    switch (e->tag) {
    case T_POSITION: return take_decimals(c, e, 3, p->position, &p->has_position);
    case T_ORIENTATION: return take_decimals(c, e, 6, p->orientation, &p->has_orientation);
    case T_SPACING: return take_decimals(c, e, 2, p->spacing, &p->has_spacing);
    case T_SLOPE: return take_decimals(c, e, 1, &p->slope, &p->has_slope);
    case T_INTERCEPT: return take_decimals(c, e, 1, &p->intercept, &p->has_intercept);
    default: return true;
    }
}

static bool take_value(const Cursor *c, const Element *e, DicomImage *image)
{
    double frames;
    bool has_frames = false;
    switch (e->tag) {
    case T_SOP: take_text(c, e, image->sop, sizeof image->sop); return true;
    case T_SERIES: take_text(c, e, image->series, sizeof image->series); return true;
    case T_MODALITY: take_text(c, e, image->modality, sizeof image->modality); return true;
    case T_DESCRIPTION: take_text(c, e, image->description, sizeof image->description); return true;
    case T_PHOTOMETRIC: take_text(c, e, image->photometric, sizeof image->photometric); return true;
    case T_ROWS: return take_short(c, e, &image->rows);
    case T_COLUMNS: return take_short(c, e, &image->columns);
    case T_ALLOCATED: return take_short(c, e, &image->allocated);
    case T_STORED: return take_short(c, e, &image->stored);
    case T_HIGH_BIT: return take_short(c, e, &image->high_bit);
    case T_SIGNED: return take_short(c, e, &image->is_signed);
    case T_SAMPLES: return take_short(c, e, &image->samples);
    case T_FRAMES:
        if (!take_decimals(c, e, 1, &frames, &has_frames))
            return false;
        if (has_frames && (!(frames >= 1 && frames <= INT32_MAX) || floor(frames) != frames))
            return fail(c, c->at, "the number of frames is not valid; expected a whole number from 1");
        image->frames = has_frames ? (long)frames : image->frames;
        return true;
    default: return take_plane(c, e, &image->file);
    }
}

static Plane *next_frame(DicomImage *image)
{
    if (image->frame_count == image->frame_capacity) {
        int capacity = image->frame_capacity ? 2 * image->frame_capacity : 64;
        Plane *more = realloc(image->frame, (size_t)capacity * sizeof *more);
        if (!more)
            return NULL;
        image->frame = more;
        image->frame_capacity = capacity;
    }
    Plane *frame = &image->frame[image->frame_count++];
    memset(frame, 0, sizeof *frame);
    return frame;
}

static bool walk(Cursor *c, size_t end, bool is_open, Scope scope, Plane *plane, DicomImage *image, int depth);

// Reads the items of a sequence, or the fragments of encapsulated pixels.
static bool walk_items(Cursor *c, size_t end, const Element *sequence, Scope scope, Plane *plane, DicomImage *image, int depth)
{
    bool is_open = sequence->length == UNDEFINED_LENGTH;
    size_t stop = is_open ? end : c->at + sequence->length;
    if (depth > MAX_DEPTH)
        return fail(c, sequence->place, "sequences are nested more than 24 deep; expected an intact file");
    while (is_open || c->at < stop) {
        Element item;
        if (!take_element(c, stop, false, &item))
            return false;
        if (item.tag == T_SEQUENCE_END && is_open)
            return true;
        if (item.tag != T_ITEM)
            return fail(c, item.place, "a sequence holds something other than an item; expected an intact file");
        Plane *own = scope == SCOPE_SHARED && sequence->tag == T_SHARED ? &image->shared : plane;
        if (scope == SCOPE_PER_FRAME && sequence->tag == T_PER_FRAME && !(own = next_frame(image)))
            return fail(c, item.place, "not enough memory for all frames");
        bool open_item = item.length == UNDEFINED_LENGTH;
        size_t item_end = open_item ? stop : c->at + item.length;
        if (!open_item && scope == SCOPE_OTHER)
            c->at = item_end;
        else if (!walk(c, item_end, open_item, scope, own, image, depth + 1))
            return false;
    }
    return true;
}

// The scope inside a sequence that occurs in `scope`.
static Scope scope_within(uint32_t tag, Scope scope)
{
    if (scope == SCOPE_FILE)
        return tag == T_SHARED ? SCOPE_SHARED : tag == T_PER_FRAME ? SCOPE_PER_FRAME : SCOPE_OTHER;
    bool is_macro = tag == T_PLANE_POSITION || tag == T_PLANE_ORIENTATION || tag == T_MEASURES || tag == T_TRANSFORMATION;
    return is_macro ? scope : SCOPE_OTHER;
}

// Reads the elements up to `end`, or up to the delimiter of an open item. The top level ends at the pixels.
static bool walk(Cursor *c, size_t end, bool is_open, Scope scope, Plane *plane, DicomImage *image, int depth)
{
    while (is_open || c->at < end) {
        Element e;
        if (!take_element(c, end, scope == SCOPE_FILE, &e))
            return false;
        if (e.tag == T_ITEM_END && is_open)
            return true;
        Scope within = scope_within(e.tag, scope);
        if (scope == SCOPE_FILE && e.tag == T_PIXELS) {
            image->has_pixels = true;
            image->is_encapsulated = e.length == UNDEFINED_LENGTH;
            image->is_words = !c->explicit_vr || !strcmp(e.vr, "OW");
            image->pixel_place = c->at;
            image->pixel_length = e.length;
            return true;
        }
        bool is_open_value = e.length == UNDEFINED_LENGTH, is_unknown = !strcmp(e.vr, "UN");
        if (is_open_value || !strcmp(e.vr, "SQ") || (within != SCOPE_OTHER && (!c->explicit_vr || is_unknown))) {
            bool kept = c->explicit_vr, order = c->big_endian;
            if (is_unknown)   // PS3.5, 6.2.2: a value of unknown VR is implicit little endian inside
                c->explicit_vr = c->big_endian = false;
            bool good = walk_items(c, end, &e, within, plane, image, depth);
            c->explicit_vr = kept;
            c->big_endian = order;
            if (!good)
                return false;
            continue;
        }
        if (scope == SCOPE_FILE ? !take_value(c, &e, image) : scope != SCOPE_OTHER && !take_plane(c, &e, plane))
            return false;
        c->at += e.length;
    }
    return true;
}

// --- a file ---

// Detects a file without preamble by its first element, which must belong to one of the groups with which files begin. The element's type or length shows
// whether the encoding is explicit or implicit.
static bool begins_bare(const FileBytes *file, bool *explicit_vr, bool *big_endian)
{
    const uint8_t *b = file->byte;
    if (file->length < 16)
        return false;
    *big_endian = b[0] == 0;
    unsigned high = *big_endian ? 0 : 1, low = 1 - high;   // bytes of a 16-bit word
    unsigned group = b[low], other = b[high], element = (unsigned)b[2 + high] << 8 | b[2 + low];
    if (other != 0 || (group != 2 && group != 8) || element > 0x0070)
        return false;
    *explicit_vr = isupper(b[4]) && isupper(b[5]);
    return *explicit_vr || (!*big_endian && (b[4] | (unsigned)b[5] << 8) <= 512 && b[6] == 0 && b[7] == 0);
}

bool volume_is_dicom(const FileBytes *file)
{
    bool a, b;
    return (file->length > PREAMBLE + 4 && !memcmp(file->byte + PREAMBLE, "DICM", 4)) || begins_bare(file, &a, &b);
}

// Reads group 0002 of a file, always explicit little endian; it determines how the rest is read.
static bool take_meta(Cursor *c, DicomImage *image)
{
    c->explicit_vr = true;
    c->big_endian = false;
    while (c->length - c->at >= 2 && c->byte[c->at] == 2 && c->byte[c->at + 1] == 0) {
        Element e;
        if (!take_element(c, c->length, false, &e))
            return false;
        if (e.length == UNDEFINED_LENGTH)
            return fail(c, e.place, "a header element of undefined length; expected an intact file");
        if (e.tag == T_TRANSFER_SYNTAX)
            take_text(c, &e, image->syntax, sizeof image->syntax);
        c->at += e.length;
    }
    return true;
}

// Bytes of the uncompressed pixels.
static size_t bytes_of_pixels(const DicomImage *m) { return (size_t)m->rows * (size_t)m->columns * (size_t)m->frames * (size_t)(m->allocated / 8); }

static bool check_image(const Cursor *c, const DicomImage *m)
{
    const char *path = c->path;
    Faults *faults = c->faults;
    if (!m->has_pixels || m->rows < 1 || m->columns < 1) {
        faults_add_at_byte(faults, path, c->offset + c->at, "the DICOM file has no image (rows, columns, pixel data); expected the files of an image series");
        return false;
    }
    int before = faults->count;
    if (m->samples != 1)
        faults_add_at_byte(faults, path, c->offset + m->pixel_place, "%ld samples per pixel (colour); expected one", m->samples);
    else if (strcmp(m->photometric, "MONOCHROME2") && strcmp(m->photometric, "MONOCHROME1"))
        faults_add_at_byte(faults, path, c->offset + m->pixel_place,
                           "the photometric interpretation '%s' is not supported; expected MONOCHROME1 or MONOCHROME2", m->photometric);
    if ((m->allocated != 8 && m->allocated != 16) || m->stored < 1 || m->stored > m->allocated || m->high_bit + 1 < m->stored || m->high_bit >= m->allocated ||
        m->is_signed > 1)
        faults_add_at_byte(faults, path, c->offset + m->pixel_place,
                           "%ld bits allocated, %ld stored, high bit %ld, representation %ld are not supported; expected "
                           "8 or 16 bits "
                           "allocated, the stored ones within, representation 0 or 1",
                           m->allocated, m->stored, m->high_bit, m->is_signed);
    if (faults->count > before)
        return false;
    // rows and columns have 16 bits, frames 31: no overflow
    size_t needed = bytes_of_pixels(m), there = c->length - m->pixel_place;
    if (there > m->pixel_length)
        there = m->pixel_length;
    if (needed > there && !m->is_encapsulated) {
        faults_add_at_byte(faults, path, c->offset + m->pixel_place + there,
                           "the pixels end after %zu of %zu bytes (%ld x %ld, %ld frames, %ld "
                           "bits); expected the whole file",
                           there, needed, m->columns, m->rows, m->frames, m->allocated);
        return false;
    }
    if (m->frame_count > 0 && m->frame_count != m->frames) {
        faults_add_at_byte(faults, path, c->offset + m->pixel_place, "%ld frames, but %d positions; expected one for each", m->frames, m->frame_count);
        return false;
    }
    return true;
}

static void image_free(DicomImage *image)
{
    free(image->frame);
    image->frame = NULL;
}

// Reads the header of a file. Returns false with faults; `image` then holds what was read until then. The caller has nothing to free.
static bool read_image(const FileBytes *file, DicomImage *image, Faults *faults)
{
    static const char implicit_little[] = "1.2.840.10008.1.2", explicit_little[] = "1.2.840.10008.1.2.1", explicit_big[] = "1.2.840.10008.1.2.2";
    Cursor c = {.byte = file->byte, .length = file->length, .offset = file->offset, .path = file->path, .faults = faults};
    *image = (DicomImage){.samples = 1, .frames = 1};
    bool is_explicit = true, is_big = false, bare = begins_bare(file, &is_explicit, &is_big);
    if (!bare)
        c.at = PREAMBLE + 4;
    if (!(bare && file->byte[is_big ? 1 : 0] == 8) && !take_meta(&c, image))
        return false;
    if (image->syntax[0]) {
        is_big = !strcmp(image->syntax, explicit_big);
        is_explicit = is_big || !strcmp(image->syntax, explicit_little);
        if (!is_explicit && strcmp(image->syntax, implicit_little)) {
            // compressed pixels have explicit little-endian headers; only a deflated file is compressed as a whole
            if (!strcmp(image->syntax, "1.2.840.10008.1.2.1.99")) {
                faults_add_at_byte(faults, file->path, c.offset + c.at, "the file is deflated; decompress it with `gdcmconv --raw IN.dcm OUT.dcm`");
                return false;
            }
            is_explicit = true;
        }
    } else if (!bare) {
        FileBytes rest = {.byte = file->byte + c.at, .length = file->length - c.at, .path = file->path};
        if (!begins_bare(&rest, &is_explicit, &is_big))
            return fail(&c, c.at, "there is no transfer syntax and the encoding cannot be guessed; expected an intact DICOM file");
    }
    c.explicit_vr = is_explicit;
    c.big_endian = image->big_endian = is_big;
    image->is_walked = walk(&c, c.length, false, SCOPE_FILE, &image->file, image, 0);
    bool good = image->is_walked && check_image(&c, image);
    if (!good)
        image_free(image);
    return good;
}

// --- slices to a grid ---

typedef struct DicomFile {
    char *path;
    DicomImage image;
} DicomFile;

typedef struct Slice {
    const DicomFile *file;
    int frame;
    Plane plane;
    double along;            // [mm] position along the normal
} Slice;

typedef struct Series {
    DicomFile *file;
    int count, capacity;
} Series;

static void series_free(Series *s)
{
    for (int i = 0; i < s->count; i++) {
        free(s->file[i].path);
        image_free(&s->file[i].image);
    }
    free(s->file);
}

// Adds an image to the series, which takes ownership of it. Returns false if out of memory.
static bool series_add(Series *s, const char *path, const DicomImage *image)
{
    if (s->count == s->capacity) {
        int capacity = s->capacity ? 2 * s->capacity : 64;
        DicomFile *more = realloc(s->file, (size_t)capacity * sizeof *more);
        if (!more)
            return false;
        s->file = more;
        s->capacity = capacity;
    }
    char *name = strdup(path);
    if (!name)
        return false;
    s->file[s->count++] = (DicomFile){name, *image};
    return true;
}

// Returns the position and scaling of a frame. Each value is the frame's own, else that given for all frames, else the file's.
static Plane plane_of(const DicomImage *m, int frame)
{
    const Plane *source[3] = {m->frame_count > 0 ? &m->frame[frame] : &m->shared, &m->shared, &m->file};
    Plane p = {.slope = 1};
    for (int i = 2; i >= 0; i--) {
        const Plane *s = source[i];
#define TAKE(HAS, FIELD)                                                                                                                                       \
    if (s->HAS)                                                                                                                                                \
    p.HAS = true, memcpy(&p.FIELD, &s->FIELD, sizeof p.FIELD)
        TAKE(has_position, position);
        TAKE(has_orientation, orientation);
        TAKE(has_spacing, spacing);
        TAKE(has_slope, slope);
        TAKE(has_intercept, intercept);
#undef TAKE
    }
    return p;
}

static int compare_slices(const void *a, const void *b)
{
    const Slice *s = a, *t = b;
    if (s->along < t->along || s->along > t->along)
        return s->along < t->along ? -1 : 1;
    int by_path = strcmp(s->file->path, t->file->path);
    return by_path ? by_path : (s->frame > t->frame) - (s->frame < t->frame);
}

static Vec3 vec3_of(const double *x) { return vec3(x[0], x[1], x[2]); }

// Checks that a slice has what is required, and that it agrees with the first slice.
static bool check_slice(const Slice *s, const Slice *first, Faults *faults)
{
    const Plane *p = &s->plane, *q = &first->plane;
    const char *path = s->file->path;
    const DicomImage *m = &s->file->image, *n = &first->file->image;
    if (!p->has_position || !p->has_orientation || !p->has_spacing) {
        faults_add_at_byte(faults, path, m->pixel_place,
                           "frame %d has no %s: not a slice of a volume (a projection, a cine run, a secondary "
                           "capture); expected images with "
                           "ImagePositionPatient, ImageOrientationPatient and PixelSpacing",
                           s->frame + 1,
                           !p->has_position      ? "position"
                           : !p->has_orientation ? "orientation"
                                                 : "pixel spacing");
        return false;
    }
    if (m->rows != n->rows || m->columns != n->columns) {
        faults_add_at_byte(faults, path, m->pixel_place, "has %ld x %ld pixels, %s %ld x %ld; expected one size for the series: move the odd file away",
                           m->columns, m->rows, first->file->path, n->columns, n->rows);
        return false;
    }
    Vec3 u = vec3_of(p->orientation), v = vec3_of(p->orientation + 3);
    if (!(p->spacing[0] > 0 && p->spacing[1] > 0) || !(fabs(vec3_norm(u) - 1) < 0.01 && fabs(vec3_norm(v) - 1) < 0.01 && fabs(vec3_dot(u, v)) < 0.01)) {
        faults_add_at_byte(faults, path, m->pixel_place,
                           "frame %d: pixel spacing %g, %g or orientation (%g,%g,%g) (%g,%g,%g) is not valid; expected spacings "
                           "above 0, two unit "
                           "vectors at right angles",
                           s->frame + 1, p->spacing[0], p->spacing[1], u.x, u.y, u.z, v.x, v.y, v.z);
        return false;
    }
    double turn = vec3_distance(u, vec3_of(q->orientation)) + vec3_distance(v, vec3_of(q->orientation + 3));
    if (turn > 2e-3 || fabs(p->spacing[0] / q->spacing[0] - 1) > 1e-3 || fabs(p->spacing[1] / q->spacing[1] - 1) > 1e-3) {
        faults_add_at_byte(faults, path, m->pixel_place,
                           "frame %d has another orientation or spacing than the first of %s; expected parallel slices of one "
                           "spacing: move the odd file "
                           "(a localizer?) away",
                           s->frame + 1, first->file->path);
        return false;
    }
    return true;
}

// Drops duplicates of an image; other slices at the same position, and gaps, are faults.
static bool check_places(Slice *slice, int *count, Vec3 *step, Faults *faults)
{
    int kept = 1;
    for (int i = 1; i < *count; i++) {
        const Slice *a = &slice[kept - 1], *b = &slice[i];
        bool is_copy = a->frame == b->frame && a->file != b->file && a->file->image.sop[0] && !strcmp(a->file->image.sop, b->file->image.sop);
        if (!is_copy)
            slice[kept++] = slice[i];
    }
    *count = kept;
    const char *path = slice[0].file->path;
    if (kept < 2) {
        faults_add(faults, path, 0, 0, "there is only one slice; expected a series of two or more, in one folder");
        return false;
    }
    double steps[2] = {HUGE_VAL, 0}, mean = (slice[kept - 1].along - slice[0].along) / (kept - 1);
    int widest = 1;
    for (int i = 1; i < kept; i++) {
        double d = slice[i].along - slice[i - 1].along;
        if (!(d > 1e-4)) {
            faults_add_at_byte(faults, slice[i].file->path, slice[i].file->image.pixel_place,
                               "frame %d has the same position as frame %d of %s (several times "
                               "or echoes in one "
                               "series?); expected one slice at each place",
                               slice[i].frame + 1, slice[i - 1].frame + 1, slice[i - 1].file->path);
            return false;
        }
        steps[0] = fmin(steps[0], d);
        if (d > steps[1])
            steps[1] = d, widest = i;
    }
    *step = vec3_scale(vec3_sub(vec3_of(slice[kept - 1].plane.position), vec3_of(slice[0].plane.position)), 1.0 / (kept - 1));
    for (int i = 1; i < kept; i++) {
        Vec3 place = vec3_add_scaled(vec3_of(slice[0].plane.position), i, *step);
        if (vec3_distance(place, vec3_of(slice[i].plane.position)) > 0.05 * mean) {
            faults_add_at_byte(faults, slice[widest].file->path, slice[widest].file->image.pixel_place,
                               "frame %d lies %.4g mm behind frame %d of %s, others lie %.4g mm "
                               "apart: slices are missing or unevenly spaced; expected all slices, evenly spaced",
                               slice[widest].frame + 1, steps[1], slice[widest - 1].frame + 1, slice[widest - 1].file->path, steps[0]);
            return false;
        }
    }
    return true;
}

static void convert_slice(const DicomImage *m, const Plane *p, const uint8_t *sample, float *value)
{
    size_t count = (size_t)m->rows * (size_t)m->columns;
    int shift = (int)(m->high_bit + 1 - m->stored);
    int32_t range = (int32_t)1 << m->stored, half = m->is_signed ? range / 2 : range;
    bool inverted = !strcmp(m->photometric, "MONOCHROME1"), wide = m->allocated == 16, big = m->big_endian;
    int32_t top = m->is_signed ? -1 : range - 1;
    for (size_t i = 0; i < count; i++) {
        // 8-bit samples in big-endian words are stored in pairs, in reversed order
        int32_t x = wide ? (big ? sample[2 * i] << 8 | sample[2 * i + 1] : sample[2 * i + 1] << 8 | sample[2 * i]) : sample[big && m->is_words ? i ^ 1 : i];
        x = x >> shift & (range - 1);
        x = x >= half ? x - range : x;
        x = inverted ? top - x : x;
        value[i] = (float)(p->slope * x + p->intercept);
    }
}

bool dicom_bytes_read(const char *path, FileBytes *out, Faults *faults)
{
    struct stat status;
    if (stat(path, &status) != 0 || (size_t)status.st_size <= DICOM_BYTES_MOST)
        return file_bytes_read(path, DICOM_BYTES_MOST, out, faults);
    faults_add(faults, path, 0, 0, "is %zu bytes long; the limit for a DICOM file is %zu", (size_t)status.st_size, (size_t)DICOM_BYTES_MOST);
    return false;
}

// A file whose slices are being read, with uncompressed pixels.
typedef struct OpenFile {
    const DicomFile *file;
    DicomImage image;        // layout of the pixels of `from`; its planes belong to another image
    FileBytes own;
    const FileBytes *from;
} OpenFile;

static void file_close(OpenFile *open)
{
    file_bytes_free(&open->own);
    *open = (OpenFile){0};
}

static bool unpack(OpenFile *open, Faults *faults)
{
    enum { HEADER_GROWTH_MAX = 1 << 20 }; // [bytes] more than a header grows when it is rewritten
    const DicomImage *m = &open->file->image;
    DicomImage plain;
    if (!dicom_unpack(open->file->path, m->pixel_place, m->syntax, m->pixel_place + bytes_of_pixels(m) + HEADER_GROWTH_MAX, &open->own, faults) ||
        !read_image(&open->own, &plain, faults))
        return false;
    image_free(&plain);
    open->from = &open->own;
    // the file's own header defines the bits of a sample: a decoder widens them to what the compressed stream could hold
    open->image = *m;
    open->image.pixel_place = plain.pixel_place;
    open->image.big_endian = plain.big_endian;
    open->image.is_words = plain.is_words;
    if (!plain.is_encapsulated && plain.rows == m->rows && plain.columns == m->columns && plain.frames == m->frames && plain.allocated == m->allocated)
        return true;
    faults_add_at_byte(faults, open->file->path, m->pixel_place,
                       "the compressed pixels decode to an image of another size than the header says; expected an intact file");
    return false;
}

// Opens a file of the series. `whole`: its bytes if it is the only file; NULL if the series is read file by file.
static bool file_open(OpenFile *open, const DicomFile *file, const FileBytes *whole, Faults *faults)
{
    if (open->file == file)
        return true;
    file_close(open);
    open->file = file;
    if (file->image.is_encapsulated)
        return unpack(open, faults);
    open->image = file->image;
    open->from = whole ? whole : &open->own;
    return whole || dicom_bytes_read(file->path, &open->own, faults);
}

static Volume *assemble(const Series *series, const FileBytes *whole, Faults *faults)
{
    size_t total = 0;
    for (int i = 0; i < series->count; i++)
        total += (size_t)series->file[i].image.frames;
    Slice *slice = total < INT32_MAX ? malloc((total + 1) * sizeof *slice) : NULL;
    Volume *volume = NULL;
    int count = 0;
    bool good = slice != NULL;
    if (!good)
        faults_add(faults, series->file[0].path, 0, 0, "not enough memory for %zu slices", total);
    for (int i = 0; good && i < series->count; i++)
        for (int k = 0; good && k < series->file[i].image.frames; k++) {
            Slice *s = &slice[count++];
            *s = (Slice){.file = &series->file[i], .frame = k, .plane = plane_of(&series->file[i].image, k)};
            good = check_slice(s, &slice[0], faults);
            Vec3 normal = vec3_cross(vec3_of(slice[0].plane.orientation), vec3_of(slice[0].plane.orientation + 3));
            s->along = vec3_dot(vec3_unit(normal), vec3_of(s->plane.position));
        }
    VolumeHeader header = {.format = "dicom", .frame = "LPS", .slope = 1};
    if (good) {
        qsort(slice, (size_t)count, sizeof *slice, compare_slices);
        good = check_places(slice, &count, &header.axis[2], faults);
    }
    const DicomFile *first = good ? slice[0].file : NULL;
    if (good) {
        const Plane *p = &slice[0].plane;
        header.size[0] = (int)first->image.columns;
        header.size[1] = (int)first->image.rows;
        header.size[2] = count;
        header.axis[0] = vec3_scale(vec3_unit(vec3_of(p->orientation)), p->spacing[1]);
        header.axis[1] = vec3_scale(vec3_unit(vec3_of(p->orientation + 3)), p->spacing[0]);
        header.origin = vec3_of(p->position);
        good = volume_header_check(&header, first->path, 0, faults) && (volume = volume_of_header(&header, first->path, faults)) != NULL;
    }
    size_t voxels = good ? (size_t)header.size[0] * (size_t)header.size[1] : 0;
    OpenFile open = {0};
    for (int i = 0; good && i < count; i++) {
        const DicomFile *file = slice[i].file;
        if (!(good = volume_goes_on(0.5 + 0.5 * i / count, file->path, faults) && file_open(&open, file, whole, faults)))
            break;
        size_t length = voxels * (size_t)(open.image.allocated / 8), start = open.image.pixel_place + (size_t)slice[i].frame * length;
        good = start <= open.from->length && open.from->length - start >= length;
        if (good)
            convert_slice(&open.image, &slice[i].plane, open.from->byte + start, volume->value + (size_t)i * voxels);
        else
            faults_add_at_byte(faults, file->path, open.from->length, "the file became shorter while it was read");
    }
    file_close(&open);
    if (good) {
        FileBytes data = {.path = first->path};
        good = volume_finish_values(volume, &data, first->image.pixel_place, 0, faults);
    }
    if (!good) {
        volume_free(volume);
        volume = NULL;
    }
    free(slice);
    return volume;
}

// --- a folder ---

static int compare_names(const void *a, const void *b) { return strcmp(*(char *const *)a, *(char *const *)b); }

// The folder's entries, sorted by name; *count is -1 if the folder cannot be read.
static char **list_folder(const char *folder, int *count)
{
    DIR *directory = opendir(folder);
    char **name = NULL;
    int capacity = 0;
    *count = directory ? 0 : -1;
    for (struct dirent *entry; directory && (entry = readdir(directory));) {
        if (entry->d_name[0] == '.')
            continue;
        if (*count == capacity) {
            char **more = realloc(name, (size_t)(capacity = capacity ? 2 * capacity : 256) * sizeof *name);
            if (!more)
                break;
            name = more;
        }
        if (!(name[*count] = strdup(entry->d_name)))
            break;
        ++*count;
    }
    if (directory)
        closedir(directory);
    if (name)
        qsort(name, (size_t)*count, sizeof *name, compare_names);
    return name;
}

// Returns true for a regular file that begins like DICOM or that cannot be read (this is reported when it is read). Other files of a folder are not read
// completely.
static bool may_be_dicom(const char *path)
{
    uint8_t head[PREAMBLE + 16];
    struct stat status = {0};
    const char *why;
    int file = regular_file_open(path, &status, &why);
    if (file < 0)
        return S_ISREG(status.st_mode);
    FileBytes bytes = {.byte = head, .length = regular_file_read(file, head, sizeof head), .path = path};
    bool is_unread = errno != 0;
    close(file);
    return is_unread || volume_is_dicom(&bytes);
}

// Adds the folder's images to the series: those of the series of `wanted`, or all if it is NULL. Files without an image (reports, DICOMDIR) are skipped. A
// damaged file is a fault unless it is known to belong to another series.
static bool gather_folder(const char *folder, const DicomImage *wanted, Series *series, Faults *faults)
{
    int count;
    char **name = list_folder(folder, &count);
    int before = faults->count;
    if (count < 0)
        faults_add(faults, folder, 0, 0, "cannot be read; expected a folder with the files of a series");
    // the pixels are read after all headers
    for (int i = 0; i < count && volume_goes_on(0.5 * i / count, folder, faults); i++) {
        char path[4096];
        int wrote = snprintf(path, sizeof path, "%s/%s", folder, name[i]);
        FileBytes file;
        DicomImage image;
        Faults own;
        faults_clear(&own);
        if (wrote < 0 || wrote >= (int)sizeof path || !may_be_dicom(path) || !dicom_bytes_read(path, &file, faults))
            continue;
        bool good = read_image(&file, &image, &own), is_other = wanted && image.series[0] && strcmp(image.series, wanted->series) != 0;
        if (!good && !is_other && !(image.is_walked && !image.has_pixels))
            read_image(&file, &image, faults);   // read again, to report its faults
        file_bytes_free(&file);
        if (!good)
            continue;
        if (is_other || (wanted && image.frames > 1)) {
            image_free(&image);
        } else if (!series_add(series, path, &image)) {
            faults_add(faults, path, 0, 0, "not enough memory for the list of files");
            image_free(&image);
        }
    }
    for (int i = 0; i < count; i++)
        free(name[i]);
    free(name);
    return faults->count == before;
}

// Each multi-frame file is a series of its own.
static bool is_same_series(const DicomFile *a, const DicomFile *b)
{
    return a == b || (a->image.frames == 1 && b->image.frames == 1 && !strcmp(a->image.series, b->image.series));
}

Volume *volume_load_dicom_folder(const char *path, Faults *faults)
{
    Series series = {0};
    char folder[4096];
    size_t n = strlen(path);
    while (n > 1 && path[n - 1] == '/')
        n--;
    snprintf(folder, sizeof folder, "%.*s", (int)(n < sizeof folder ? n : sizeof folder - 1), path);
    bool good = gather_folder(folder, NULL, &series, faults);
    if (good && series.count == 0) {
        faults_add(faults, path, 0, 0, "the folder has no DICOM images; expected the folder of a series, or a volume's file");
        good = false;
    }
    bool is_one = true;
    for (int i = 1; i < series.count; i++)
        is_one = is_one && is_same_series(&series.file[0], &series.file[i]);
    if (good && !is_one) {
        // one fault for each series, reported at its first file
        faults_add(faults, path, 0, 0, "several series in one folder; name one file of the series that you want:");
        for (int i = 0; i < series.count; i++) {
            const DicomFile *f = &series.file[i];
            int files = 0, earlier = 0;
            for (int k = 0; k < series.count; k++)
                if (is_same_series(f, &series.file[k]))
                    files++, earlier += k < i;
            if (!earlier)
                faults_add(faults, f->path, 0, 0, "a series of %d file%s, %ld x %ld pixels%s, %s '%s'", files, files > 1 ? "s" : "", f->image.columns,
                           f->image.rows, f->image.frames > 1 ? ", multi-frame" : "", f->image.modality, f->image.description);
        }
        good = false;
    }
    Volume *volume = good ? assemble(&series, NULL, faults) : NULL;
    series_free(&series);
    return volume;
}

Volume *volume_parse_dicom(const FileBytes *file, Faults *faults)
{
    DicomImage image;
    Series series = {0};
    struct stat status;
    if (!read_image(file, &image, faults))
        return NULL;
    bool alone = image.frames > 1 || stat(file->path, &status) != 0;
    bool good = true;
    if (alone) {
        good = series_add(&series, file->path, &image);
        if (!good) {
            image_free(&image);
            faults_add(faults, file->path, 0, 0, "needs more memory than is available");
        }
    } else {
        char folder[4096];
        const char *slash = strrchr(file->path, '/');
        int n = slash ? (int)(slash - file->path) : 0;
        snprintf(folder, sizeof folder, "%.*s", slash ? (n > 0 ? n : 1) : 1, slash ? file->path : ".");
        good = gather_folder(folder, &image, &series, faults);
        image_free(&image);
        if (good && series.count == 0) {   // the file disappeared while the folder was read
            faults_add(faults, file->path, 0, 0, "cannot be opened; expected a readable file");
            good = false;
        }
    }
    Volume *volume = good ? assemble(&series, alone ? file : NULL, faults) : NULL;
    series_free(&series);
    return volume;
}
