// libyaml's document API keeps the line and column of every node but accepts duplicate keys; this reader refuses them.
#include "base/yaml_reader.h"

#include "base/nearest_name.h"
#include "base/number_table.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

enum { VISIT_BUDGET = 4000000, MOST_KEYS = 64, DEEPEST = 100 };

struct YamlReader {
    yaml_document_t document;
    char *file;
    Faults *faults;
    long visits;
};

// --- suggestions for names ---

static const char *const units[] = {"mm",    "cm",    "m",      "um",    "in",   "s",    "ms",  "us",    "min",   "gpa",  "mpa", "kpa",     "pa",  "n_mm2",
                                    "g_cm3", "kg_m3", "g_mm3",  "n",     "mn",   "n_mm", "n_m", "deg",   "rad",   "1_mm", "1_m", "1_cm",    "1_s", "1_ms",
                                    "m_s2",  "mm_s2", "mm_ms2", "cm_s2", "mm_s", "cm_s", "m_s", "deg_s", "rad_s", "hz",   "psi", "percent", NULL};

static bool same_letters(const char *a, const char *b)
{
    while (*a && tolower((unsigned char)*a) == tolower((unsigned char)*b))
        a++, b++;
    return *a == *b;
}

static bool is_unit(const char *text)
{
    for (int i = 0; units[i]; i++)
        if (same_letters(text, units[i]))
            return true;
    return false;
}

// Length of the name without its unit: the shortest stem followed by exactly one unit; the whole name if it has none.
static size_t stem_length(const char *name)
{
    for (const char *at = strchr(name, '_'); at; at = strchr(at + 1, '_'))
        if (is_unit(at + 1))
            return (size_t)(at - name);
    return strlen(name);
}

static bool same_stem(const char *a, const char *b)
{
    size_t n = stem_length(a);
    if (n == 0 || n != stem_length(b))
        return false;
    for (size_t i = 0; i < n; i++)
        if (tolower((unsigned char)a[i]) != tolower((unsigned char)b[i]))
            return false;
    return true;
}

static void list_names(const char *const *names, char *out, size_t capacity)
{
    size_t used = 0;
    out[0] = 0;
    for (int i = 0; names[i] && used + 1 < capacity; i++) {
        int wrote = snprintf(out + used, capacity - used, "%s%s", i ? ", " : "", names[i]);
        used += wrote > 0 ? (size_t)wrote : 0;
    }
}

static void fault_unknown_key(YamlValue key, const char *name, const char *map_name, const char *const *keys)
{
    for (int i = 0; keys[i]; i++)
        if (same_stem(name, keys[i])) {
            if (stem_length(name) == strlen(name))
                yaml_fault(key, "key '%s' has no unit; expected '%s'", name, keys[i]);
            else if (stem_length(keys[i]) == strlen(keys[i]))
                yaml_fault(key, "key '%s' has a unit; expected '%s'", name, keys[i]);
            else
                yaml_fault(key, "key '%s' has the wrong unit; expected '%s'", name, keys[i]);
            return;
        }
    int nearest = nearest_name(name, keys);
    if (nearest >= 0) {
        yaml_fault(key, "unknown key '%.60s'; did you mean '%s'?", name, keys[nearest]);
        return;
    }
    char all[FAULT_LENGTH - 80];
    list_names(keys, all, sizeof all);
    yaml_fault(key, "unknown key '%.60s' in '%s'; expected %s", name, map_name, all);
}

// --- the document ---

static int line_of_offset(const char *text, size_t length, size_t offset)
{
    int line = 1;
    for (size_t i = 0; i < offset && i < length; i++)
        line += text[i] == '\n';
    return line;
}

static void fault_syntax(const yaml_parser_t *parser, const char *text, size_t length, const char *file, Faults *faults)
{
    const char *problem = parser->problem ? parser->problem : "the text cannot be parsed";
    if (parser->error == YAML_READER_ERROR)
        faults_add(faults, file, line_of_offset(text, length, parser->problem_offset), 1, "is not YAML: %s (byte %zu); expected UTF-8 text", problem,
                   parser->problem_offset);
    else if (parser->error == YAML_MEMORY_ERROR)
        faults_add(faults, file, 0, 0, "out of memory");
    else
        faults_add(faults, file, (int)parser->problem_mark.line + 1, (int)parser->problem_mark.column + 1, "is not YAML: %s%s%s", problem,
                   parser->context ? " " : "", parser->context ? parser->context : "");
}

// libyaml's time grows with the square of the nesting depth of [ and {, so a first pass over the events refuses deep nesting. Returns false with a fault in
// that case, or if
// the text is not YAML.
static bool check_depth(const char *text, size_t length, const char *file, Faults *faults)
{
    yaml_parser_t parser;
    if (!yaml_parser_initialize(&parser)) {
        faults_add(faults, file, 0, 0, "out of memory");
        return false;
    }
    yaml_parser_set_input_string(&parser, (const unsigned char *)text, length);
    int depth = 0;
    bool good = true;
    for (bool ended = false; good && !ended;) {
        yaml_event_t event;
        if (!yaml_parser_parse(&parser, &event)) {
            fault_syntax(&parser, text, length, file, faults);
            good = false;
            break;
        }
        depth += event.type == YAML_SEQUENCE_START_EVENT || event.type == YAML_MAPPING_START_EVENT;
        depth -= event.type == YAML_SEQUENCE_END_EVENT || event.type == YAML_MAPPING_END_EVENT;
        if (depth > DEEPEST) {
            faults_add(faults, file, (int)event.start_mark.line + 1, (int)event.start_mark.column + 1,
                       "lists and maps are nested more than %d deep; expected at most 6", DEEPEST);
            good = false;
        }
        ended = event.type == YAML_STREAM_END_EVENT;
        yaml_event_delete(&event);
    }
    yaml_parser_delete(&parser);
    return good;
}

YamlReader *yaml_reader_open(const char *text, size_t length, const char *file, Faults *faults)
{
    yaml_parser_t parser;
    if (!check_depth(text, length, file, faults))
        return NULL;
    YamlReader *reader = calloc(1, sizeof *reader);
    if (!reader || !(reader->file = strdup(file)) || !yaml_parser_initialize(&parser)) {
        faults_add(faults, file, 0, 0, "out of memory");
        if (reader)
            free(reader->file);
        free(reader);
        return NULL;
    }
    reader->faults = faults;
    yaml_parser_set_input_string(&parser, (const unsigned char *)text, length);
    bool good = false, loaded = yaml_parser_load(&parser, &reader->document) != 0;
    if (!loaded)
        fault_syntax(&parser, text, length, file, faults);
    else if (!yaml_document_get_root_node(&reader->document))
        faults_add(faults, file, 1, 1, "is empty; expected YAML keys and values");
    else {
        yaml_document_t second;
        int line = (int)parser.mark.line + 1;
        if (!yaml_parser_load(&parser, &second)) {
            fault_syntax(&parser, text, length, file, faults);
        } else {
            good = !yaml_document_get_root_node(&second);
            if (!good)
                faults_add(faults, file, line, 1, "a second YAML document begins here; expected only one");
            yaml_document_delete(&second);
        }
    }
    yaml_parser_delete(&parser);
    if (!good) {
        if (loaded)
            yaml_document_delete(&reader->document);
        free(reader->file);
        free(reader);
        return NULL;
    }
    return reader;
}

void yaml_reader_close(YamlReader *reader)
{
    if (!reader)
        return;
    yaml_document_delete(&reader->document);
    free(reader->file);
    free(reader);
}

static yaml_node_t *node_of(YamlValue value) { return value.node > 0 ? yaml_document_get_node(&value.reader->document, value.node) : NULL; }

YamlValue yaml_root(YamlReader *reader) { return (YamlValue){.reader = reader, .node = 1, .name = "scene"}; }

void yaml_place(YamlValue value, int *line, int *column)
{
    const yaml_node_t *node = node_of(value);
    *line = node ? (int)node->start_mark.line + 1 : 0;
    *column = node ? (int)node->start_mark.column + 1 : 0;
}

void yaml_fault(YamlValue value, const char *format, ...)
{
    char text[FAULT_LENGTH];
    int line, column;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    yaml_place(value, &line, &column);
    faults_add(value.reader->faults, value.reader->file, line, column, "%s", text);
}

// Counts a visit. Returns false (with one fault) after far more visits than a scene needs.
static bool may_visit(YamlValue value)
{
    if (value.reader->visits++ == VISIT_BUDGET)
        yaml_fault(value, "the file is too large or its aliases repeat too much; expected at most %d values", VISIT_BUDGET);
    return value.reader->visits <= VISIT_BUDGET;
}

static YamlValue child(YamlValue parent, int node, const char *key)
{
    YamlValue value = {.reader = parent.reader, .node = node};
    bool top = !strcmp(parent.name, "scene");
    snprintf(value.name, sizeof value.name, "%.60s%s%.32s", top ? "" : parent.name, top ? "" : ".", key);
    return value;
}

YamlMap yaml_map(YamlValue value, const char *const *keys)
{
    YamlMap map = {.value = value, .keys = keys};
    yaml_node_t *node = node_of(value);
    if (!node)
        return map;
    if (!may_visit(value) || node->type != YAML_MAPPING_NODE) {
        if (node->type != YAML_MAPPING_NODE)
            yaml_fault(value, "'%s' is not a map; expected keys and values", value.name);
        map.value.node = 0;
        return map;
    }
    int count = (int)(node->data.mapping.pairs.top - node->data.mapping.pairs.start);
    if (count > MOST_KEYS) {
        yaml_fault(value, "'%s' has %d keys; expected at most %d", value.name, count, MOST_KEYS);
        map.value.node = 0;
        return map;
    }
    for (int i = 0; i < count; i++) {
        YamlValue key = {.reader = value.reader, .node = node->data.mapping.pairs.start[i].key};
        const char *name = yaml_scalar(key);
        if (!name) {
            yaml_fault(key, "a key of '%s' is not a string", value.name);
            continue;
        }
        for (int j = 0; j < i; j++) {
            YamlValue before = {.reader = value.reader, .node = node->data.mapping.pairs.start[j].key};
            const char *other = yaml_scalar(before);
            int line, column;
            if (!other || strcmp(other, name))
                continue;
            yaml_place(before, &line, &column);
            yaml_fault(key, "duplicate key '%.60s' in '%s'; the first is on line %d", name, value.name, line);
            break;
        }
        bool known = !keys;
        for (int j = 0; !known && keys[j]; j++)
            known = !strcmp(name, keys[j]);
        if (!known)
            fault_unknown_key(key, name, value.name, keys);
    }
    return map;
}

bool yaml_pair(const YamlMap *map, int index, const char **key, YamlValue *value)
{
    yaml_node_t *node = node_of(map->value);
    if (!node || index < 0 || index >= node->data.mapping.pairs.top - node->data.mapping.pairs.start)
        return false;
    yaml_node_pair_t pair = node->data.mapping.pairs.start[index];
    YamlValue name = {.reader = map->value.reader, .node = pair.key};
    *key = yaml_scalar(name);
    *value = child(map->value, pair.value, *key ? *key : "?");
    return true;
}

YamlValue yaml_get(const YamlMap *map, const char *key, bool required)
{
    const char *name;
    YamlValue value;
    for (int i = 0; yaml_pair(map, i, &name, &value); i++)
        if (name && !strcmp(name, key))
            return value;
    if (required && map->value.node)
        yaml_fault(map->value, "'%s' has no key '%s'; it is required", map->value.name, key);
    value = child(map->value, 0, key);
    return value;
}

bool yaml_has(const YamlMap *map, const char *key) { return yaml_get(map, key, false).node != 0; }

bool yaml_is_list(YamlValue value)
{
    const yaml_node_t *node = node_of(value);
    return node && node->type == YAML_SEQUENCE_NODE;
}

bool yaml_is_map(YamlValue value)
{
    const yaml_node_t *node = node_of(value);
    return node && node->type == YAML_MAPPING_NODE;
}

int yaml_count(YamlValue value, int least, int most)
{
    const yaml_node_t *node = node_of(value);
    if (!node)
        return -1;
    if (node->type != YAML_SEQUENCE_NODE) {
        yaml_fault(value, "'%s' is not a list; expected [a, b, …] or lines that begin with '- '", value.name);
        return -1;
    }
    long count = (long)(node->data.sequence.items.top - node->data.sequence.items.start);
    if (count < least || count > most) {
        yaml_fault(value, "'%s' has %ld entries; expected %d to %d", value.name, count, least, most);
        return -1;
    }
    return (int)count;
}

YamlValue yaml_item(YamlValue list, int index)
{
    const yaml_node_t *node = node_of(list);
    YamlValue value = {.reader = list.reader};
    snprintf(value.name, sizeof value.name, "%.80s[%d]", list.name, index);
    if (node && node->type == YAML_SEQUENCE_NODE && index >= 0 && index < node->data.sequence.items.top - node->data.sequence.items.start)
        value.node = node->data.sequence.items.start[index];
    return value;
}

// --- values ---

const char *yaml_scalar(YamlValue value)
{
    const yaml_node_t *node = node_of(value);
    return node && node->type == YAML_SCALAR_NODE ? (const char *)node->data.scalar.value : NULL;
}

static void write_flow_text(FILE *out, const yaml_node_t *node)
{
    const char *text = (const char *)node->data.scalar.value;
    bool is_plain = node->data.scalar.style == YAML_PLAIN_SCALAR_STYLE && !strpbrk(text, ",[]{}\n");
    if (is_plain) {
        fputs(text, out);
        return;
    }
    fputc('"', out);
    for (; *text; text++) {
        if (*text == '\n' || *text == '\t')
            fputs(*text == '\n' ? "\\n" : "\\t", out);
        else
            fprintf(out, *text == '"' || *text == '\\' ? "\\%c" : "%c", *text);
    }
    fputc('"', out);
}

static bool write_flow(FILE *out, YamlValue value, int node_index, int depth)
{
    const yaml_node_t *node = yaml_document_get_node(&value.reader->document, node_index);
    if (!node || depth > DEEPEST || !may_visit(value))
        return false;
    if (node->type == YAML_SCALAR_NODE) {
        write_flow_text(out, node);
        return true;
    }
    bool good = true, is_list = node->type == YAML_SEQUENCE_NODE;
    fputc(is_list ? '[' : '{', out);
    if (is_list)
        for (yaml_node_item_t *item = node->data.sequence.items.start; good && item < node->data.sequence.items.top; item++) {
            fputs(item > node->data.sequence.items.start ? ", " : "", out);
            good = write_flow(out, value, *item, depth + 1);
        }
    else
        for (yaml_node_pair_t *pair = node->data.mapping.pairs.start; good && pair < node->data.mapping.pairs.top; pair++) {
            fputs(pair > node->data.mapping.pairs.start ? ", " : "", out);
            good = write_flow(out, value, pair->key, depth + 1);
            fputs(": ", out);
            good = good && write_flow(out, value, pair->value, depth + 1);
        }
    fputc(is_list ? ']' : '}', out);
    return good;
}

char *yaml_flow(YamlValue value)
{
    char *text = NULL;
    size_t length;
    FILE *out = open_memstream(&text, &length);
    bool good = out && write_flow(out, value, value.node, 0);
    if (out && fclose(out) != 0)
        good = false;
    if (good)
        return text;
    free(text);
    yaml_fault(value, "'%s' cannot be written on one line; expected a number, a text, or a short list or map", value.name);
    return NULL;
}

bool yaml_text(YamlValue value, const char **text)
{
    const yaml_node_t *node = node_of(value);
    if (!node || !may_visit(value))
        return false;
    if (node->type != YAML_SCALAR_NODE || node->data.scalar.length == 0 || strlen((const char *)node->data.scalar.value) != node->data.scalar.length) {
        yaml_fault(value, "'%s' is not a string; expected one word or a quoted string", value.name);
        return false;
    }
    *text = (const char *)node->data.scalar.value;
    return true;
}

// Reads the scalar as a number; otherwise adds a fault with what was expected.
static bool scalar_number(YamlValue value, const char *valid, double *number)
{
    const yaml_node_t *node = node_of(value);
    if (!node || !may_visit(value))
        return false;
    if (node->type == YAML_SCALAR_NODE && node->data.scalar.style == YAML_PLAIN_SCALAR_STYLE &&
        number_of_text((const char *)node->data.scalar.value, node->data.scalar.length, number))
        return true;
    if (node->type != YAML_SCALAR_NODE)
        yaml_fault(value, "'%s' is a %s; expected %s", value.name, node->type == YAML_SEQUENCE_NODE ? "list" : "map", valid);
    else
        yaml_fault(value, "'%s' is '%.40s', not a number; expected %s (the unit is part of the key)", value.name, (const char *)node->data.scalar.value, valid);
    return false;
}

bool yaml_number(YamlValue value, NumberRange range, double *number)
{
    char valid[96];
    double read;
    snprintf(valid, sizeof valid, "a number %s %g and at most %g", range.above ? "above" : "of at least", range.least, range.most);
    if (!scalar_number(value, valid, &read))
        return false;
    if (read < range.least || read > range.most || (range.above && read == range.least)) {
        yaml_fault(value, "'%s' is %g, out of range; expected %s", value.name, read, valid);
        return false;
    }
    *number = read;
    return true;
}

bool yaml_integer(YamlValue value, int least, int most, int *number)
{
    char valid[96];
    double read;
    snprintf(valid, sizeof valid, "a whole number from %d to %d", least, most);
    if (!scalar_number(value, valid, &read))
        return false;
    if (read != floor(read) || read < least || read > most) {
        yaml_fault(value, "'%s' is %.12g; expected %s", value.name, read, valid);
        return false;
    }
    *number = (int)read;
    return true;
}

bool yaml_boolean(YamlValue value, bool *answer)
{
    static const char *const names[] = {"false", "true", NULL};
    int choice = value.node ? yaml_choice(value, names) : -1;
    if (choice >= 0)
        *answer = choice == 1;
    return choice >= 0;
}

int yaml_choice(YamlValue value, const char *const *names)
{
    const char *text;
    if (!yaml_text(value, &text))
        return -1;
    for (int i = 0; names[i]; i++)
        if (!strcmp(names[i], text))
            return i;
    char all[400];
    list_names(names, all, sizeof all);
    yaml_fault(value, "'%s' is '%.40s'; expected one of: %s", value.name, text, all);
    return -1;
}

bool yaml_map_number(const YamlMap *map, const char *key, bool required, NumberRange range, double *number)
{
    return yaml_number(yaml_get(map, key, required), range, number);
}
