// Writes small DICOM files for tests, byte by byte: elements in any of the three uncompressed encodings.
#ifndef SELDINGER_TESTS_RECON_DICOM_FILE_H
#define SELDINGER_TESTS_RECON_DICOM_FILE_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

typedef enum DicomEncoding { IMPLICIT_LITTLE, EXPLICIT_LITTLE, EXPLICIT_BIG } DicomEncoding;

typedef struct DicomBytes {
    uint8_t byte[1 << 16];
    size_t length;
    DicomEncoding encoding;
} DicomBytes;

static inline void dicom_bits(DicomBytes *d, uint32_t bits, int size, bool big)
{
    for (int i = 0; i < size; i++)
        d->byte[d->length++] = (uint8_t)(bits >> (8 * (big ? size - 1 - i : i)));
}

// Writes tag, type and length; the value follows. Length 0xffffffff: undefined, ends at its delimiter.
static inline void dicom_head(DicomBytes *d, uint32_t tag, const char *vr, uint32_t length)
{
    bool big = d->encoding == EXPLICIT_BIG && tag >> 16 != 2;
    dicom_bits(d, tag >> 16, 2, big);
    dicom_bits(d, tag & 0xffff, 2, big);
    if ((d->encoding == IMPLICIT_LITTLE && tag >> 16 != 2) || tag >> 16 == 0xfffe) {
        dicom_bits(d, length, 4, big);
        return;
    }
    memcpy(d->byte + d->length, vr, 2);
    d->length += 2;
    bool is_long = strstr("OB OW SQ UN UT", vr) != NULL;
    if (is_long)
        dicom_bits(d, 0, 2, big);
    dicom_bits(d, length, is_long ? 4 : 2, big);
}

static inline void dicom_text(DicomBytes *d, uint32_t tag, const char *vr, const char *text)
{
    size_t n = strlen(text);
    dicom_head(d, tag, vr, (uint32_t)(n + n % 2));
    memcpy(d->byte + d->length, text, n);
    d->length += n;
    if (n % 2)
        d->byte[d->length++] = !strcmp(vr, "UI") ? 0 : ' ';
}

static inline void dicom_short(DicomBytes *d, uint32_t tag, unsigned value)
{
    dicom_head(d, tag, "US", 2);
    dicom_bits(d, value, 2, d->encoding == EXPLICIT_BIG);
}

// Writes the preamble and group 2, or nothing.
static inline void dicom_begin(DicomBytes *d, DicomEncoding encoding, bool preamble, const char *syntax)
{
    static const char *const own[] = {"1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.2"};
    d->length = 0;
    d->encoding = encoding;
    if (!preamble)
        return;
    memset(d->byte, 0, 128);
    memcpy(d->byte + 128, "DICM", 4);
    d->length = 132;
    dicom_text(d, 0x00020010, "UI", syntax ? syntax : own[encoding]);
}

#endif
