// Runs a fuzz target without libFuzzer, with every file of a corpus folder: whole, cut at every length (at most 2,000, evenly spread), with a trailing byte,
// and with single bytes flipped (at most 2,000). Under ASan and UBSan this is the regression test of the parsers.
// usage: corpus_NAME [MOST] FOLDER...; MOST lengths and bytes instead of 2,000.
#include <dirent.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void try_input(const uint8_t *data, size_t size)
{
    // an exact allocation, so that a read past the end is detected
    uint8_t *copy = malloc(size ? size : 1);
    if (!copy)
        exit(2);
    if (size)
        memcpy(copy, data, size);
    LLVMFuzzerTestOneInput(copy, size);
    free(copy);
}

static void try_file(const char *path, size_t most)
{
    FILE *file = fopen(path, "rb");
    if (!file) {
        perror(path);
        exit(2);
    }
    size_t size = 0, capacity = 1 << 16;
    uint8_t *data = malloc(capacity + 1);
    while (data && (size += fread(data + size, 1, capacity - size, file)) == capacity)
        data = realloc(data, (capacity *= 2) + 1);
    fclose(file);
    if (!data)
        exit(2);
    try_input(data, size);
    size_t step = size / most + 1;
    for (size_t n = 0; n < size; n += step)
        try_input(data, n);
    data[size] = 'x';
    try_input(data, size + 1);
    for (size_t n = 0; n < size; n += step) {
        uint8_t kept = data[n];
        data[n] = (uint8_t)(kept ^ (1u << (n % 8)));
        try_input(data, size);
        data[n] = kept;
    }
    free(data);
}

int main(int argc, char **argv)
{
    int files = 0;
    unsigned long most = argc > 1 ? strtoul(argv[1], NULL, 10) : 0;     // 0: a folder
    for (int i = most ? 2 : 1; i < argc; i++) {
        DIR *folder = opendir(argv[i]);
        if (!folder) {
            fprintf(stderr, "%s: no such corpus folder\n", argv[i]);
            return 2;
        }
        for (struct dirent *entry; (entry = readdir(folder));) {
            char path[4096];
            if (entry->d_name[0] == '.')
                continue;
            snprintf(path, sizeof path, "%s/%s", argv[i], entry->d_name);
            try_file(path, most ? most : 2000);
            files++;
        }
        closedir(folder);
    }
    printf("%d corpus files\n", files);
    return files > 0 ? 0 : 2;
}
