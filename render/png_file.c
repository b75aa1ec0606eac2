// No time stamp and a fixed compression level, so that the same pixels give the same bytes.
#include "render/png_file.h"

#include "base/base.h"
#include "render/message.h"

#include <errno.h>
#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static void leave(png_structp png, png_const_charp text)
{
    (void)text;
    png_longjmp(png, 1);
}

static void keep_quiet(png_structp png, png_const_charp text)
{
    (void)png;
    (void)text;
}

static bool write_pixels(FILE *file, int width, int height, const uint8_t *rgb)
{
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, leave, keep_quiet);
    if (!png)
        return false;
    png_infop info = png_create_info_struct(png);
    if (!info || setjmp(png_jmpbuf(png))) {   // libpng reports errors, including a full disk, by longjmp
        png_destroy_write_struct(&png, info ? &info : NULL);
        return false;
    }
    png_init_io(png, file);
    png_set_compression_level(png, 6);
    png_set_IHDR(png, info, (png_uint_32)width, (png_uint_32)height, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    for (int y = 0; y < height; y++)
        png_write_row(png, rgb + (size_t)y * (size_t)width * 3);
    png_write_end(png, NULL);
    png_destroy_write_struct(&png, &info);
    return true;
}

bool png_file_write(const char *path, int width, int height, const uint8_t *rgb, char *message, size_t capacity)
{
    if (part_file_is_through(path))
        return message_fail(message, capacity, "%s: exists and is not a regular file; give another name", path);
    PartFile part;
    errno = 0;
    bool written = part_file_begin(&part, path);
    FILE *file = written ? part_file_stream(&part) : NULL;
    written = file && write_pixels(file, width, height, rgb) && part_file_finish_synced(&part);
    if (!written)
        message_fail(message, capacity, "%s: cannot be written: %s", path, errno ? strerror(errno) : "write error");
    part_file_drop(&part);
    return written;
}
