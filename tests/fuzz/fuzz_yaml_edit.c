// The first two lines of the input are a path of plain keys and a value; the rest is a text into which the value is written. A valid YAML document stays valid.
// Covers: base/yaml_edit.c
#include "base/yaml_edit.h"
#include "base/yaml_reader.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static char *cut_line(char **text)
{
    char *line = *text, *end = strchr(line, '\n');
    *text = end ? end + 1 : line + strlen(line);
    if (end)
        *end = '\0';
    return line;
}

static bool is_yaml(const char *text)
{
    static Faults faults;
    faults_clear(&faults);
    YamlReader *reader = yaml_reader_open(text, strlen(text), "edited.yaml", &faults);
    yaml_reader_close(reader);
    return reader != NULL;
}

static void require_yaml(char *text)
{
    if (text && !is_yaml(text))
        abort();
    free(text);
}

static bool is_path(const char *text)
{
    size_t length = strspn(text, "abcdefghijklmnopqrstuvwxyz_.0123456789");
    return length > 0 && !text[length] && text[0] != '.' && text[length - 1] != '.' && !strstr(text, "..");
}

static bool is_plain(const char *text)
{
    for (; *text; text++)
        if ((unsigned char)*text < ' ' || (unsigned char)*text > '~')
            return false;
    return true;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char *copy = malloc(size + 1), *text = copy;
    memcpy(copy, data, size);
    copy[size] = '\0';
    char *path = cut_line(&text), *value = cut_line(&text);
    if (is_path(path) && is_plain(value) && is_yaml(text)) {
        require_yaml(yaml_edit(text, path, value, false));
        require_yaml(yaml_edit(text, path, value, true));
        require_yaml(yaml_edit_append(text, path, "{device: a.yaml, length_mm: 100}"));
    }
    free(copy);
    return 0;
}
