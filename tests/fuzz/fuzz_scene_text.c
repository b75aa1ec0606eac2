// The first two lines of the input are a key and a value; the rest is a scene's text, in which the library sets the value. It refuses with a fault, or the key
// has the value and everything else is as it was.
// Covers: sim/library/scene.c base/yaml_edit.c
#include "base/yaml_reader.h"
#include "seldinger/seldinger.h"

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

// In flow style; what is too large for that is not compared.
static void require_same(YamlValue a, YamlValue b)
{
    char *x = yaml_flow(a), *y = yaml_flow(b);
    if (x && y && strcmp(x, y) != 0)
        abort();
    free(x);
    free(y);
}

static void require_set(YamlValue before, YamlValue after, const char *key, YamlValue wanted);

static void require_set_in_list(YamlValue before, YamlValue after, const char *key, YamlValue wanted)
{
    long index = strtol(key, NULL, 10);
    int count = yaml_count(before, 0, 1000000);
    if (count != yaml_count(after, 0, 1000000) || index >= count)
        abort();
    for (int i = 0; i < count; i++) {
        const char *dot = strchr(key, '.');
        if (i == index)
            require_set(yaml_item(before, i), yaml_item(after, i), dot ? dot + 1 : NULL, wanted);
        else
            require_same(yaml_item(before, i), yaml_item(after, i));
    }
}

// `key` below this value, NULL: the value itself, which is absent before if the key was added.
static void require_set(YamlValue before, YamlValue after, const char *key, YamlValue wanted)
{
    if (!key) {
        require_same(after, wanted);
        return;
    }
    if (yaml_is_list(before)) {
        require_set_in_list(before, after, key, wanted);
        return;
    }
    YamlMap x = yaml_map(before, NULL), y = yaml_map(after, NULL);
    const char *name, *old_name, *dot = strchr(key, '.');
    size_t length = dot ? (size_t)(dot - key) : strlen(key);
    YamlValue old = before, new;
    bool has_key = false;
    for (int i = 0; !has_key && yaml_pair(&x, i, &old_name, &old); i++)
        has_key = old_name && strlen(old_name) == length && !memcmp(old_name, key, length);
    if (has_key || dot) {
        bool is_found = false;
        int i = 0;
        for (; yaml_pair(&x, i, &old_name, &old); i++) {
            if (!yaml_pair(&y, i, &name, &new) || !name != !old_name || (name && strcmp(name, old_name) != 0))
                abort();
            bool is_set = !is_found && name && strlen(name) == length && !memcmp(name, key, length);
            is_found |= is_set;
            if (is_set)
                require_set(old, new, dot ? dot + 1 : NULL, wanted);
            else
                require_same(old, new);
        }
        if (!is_found || yaml_pair(&y, i, &name, &new))
            abort();
        return;
    }
    if (!yaml_pair(&y, 0, &name, &new) || !name || strcmp(name, key) != 0)        // added before the others
        abort();
    require_same(new, wanted);
    int i = 0;
    for (; yaml_pair(&x, i, &old_name, &old); i++)
        if (!yaml_pair(&y, i + 1, &name, &new) || !name != !old_name || (name && strcmp(name, old_name) != 0))
            abort();
        else
            require_same(old, new);
    if (yaml_pair(&y, i + 1, &name, &new))
        abort();
}

static void require_change(const char *text, const char *changed, const char *key, const char *value)
{
    static Faults ignored;
    faults_clear(&ignored);
    YamlReader *before = yaml_reader_open(text, strlen(text), "before.yaml", &ignored), *after = yaml_reader_open(changed, strlen(changed), "after", &ignored),
               *wanted = yaml_reader_open(value, strlen(value), "value", &ignored);
    if (!before || !after || !wanted)
        abort();
    require_set(yaml_root(before), yaml_root(after), key, yaml_root(wanted));
    yaml_reader_close(before);
    yaml_reader_close(after);
    yaml_reader_close(wanted);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static SelContext *context;
    if (!context && sel_context_create(NULL, &context) != SEL_OK)
        exit(2);
    char *copy = malloc(size + 1), *text = copy;
    memcpy(copy, data, size);
    copy[size] = '\0';
    char *key = cut_line(&text), *value = cut_line(&text), *changed = NULL, *again = NULL;
    SelStatus status = sel_scene_text_with(context, text, key, value, &changed);
    if (status != SEL_OK && (status != SEL_ERROR_INPUT || changed || sel_fault_count(context) == 0))
        abort();
    if (status == SEL_OK) {
        require_change(text, changed, key, value);
        if (sel_scene_text_with(context, changed, key, value, &again) != SEL_OK)        // what was set can be set again
            abort();
        require_change(changed, again, key, value);
    }
    sel_free(changed);
    sel_free(again);
    free(copy);
    return 0;
}
