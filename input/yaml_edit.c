#include "input/yaml_edit.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

// The place in bytes of a mark, which counts characters and not the byte order mark.
static size_t byte_of(const char *text, size_t characters)
{
    size_t at = strncmp(text, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
    for (; text[at] && characters > 0; characters--)
        for (at++; ((unsigned char)text[at] & 0xC0) == 0x80;)
            at++;
    return at;
}

// An item of a list by its number, from 0.
static yaml_node_t *item_of(yaml_document_t *document, const yaml_node_t *list, const char *number)
{
    char *end;
    long index = *number >= '0' && *number <= '9' ? strtol(number, &end, 10) : -1;
    bool whole = index >= 0 && *end == '.' && index < list->data.sequence.items.top - list->data.sequence.items.start;
    return whole ? yaml_document_get_node(document, list->data.sequence.items.start[index]) : NULL;
}

static yaml_node_t *value_of(yaml_document_t *document, const yaml_node_t *map, const char *key, size_t length)
{
    if (map->type == YAML_SEQUENCE_NODE)
        return item_of(document, map, key);
    if (map->type != YAML_MAPPING_NODE)
        return NULL;
    for (yaml_node_pair_t *pair = map->data.mapping.pairs.start; pair < map->data.mapping.pairs.top; pair++) {
        const yaml_node_t *name = yaml_document_get_node(document, pair->key);
        if (name->type == YAML_SCALAR_NODE && name->data.scalar.length == length && !memcmp(name->data.scalar.value, key, length))
            return yaml_document_get_node(document, pair->value);
    }
    return NULL;
}

static void write_quoted(FILE *stream, const char *value)
{
    fputc('"', stream);
    for (; *value; value++) {
        if (*value == '"' || *value == '\\')
            fputc('\\', stream);
        fputc(*value, stream);
    }
    fputc('"', stream);
}

// Replaces the bytes from `from` to `to`; `key` NULL, or what stands before the value.
static char *spliced(const char *text, size_t from, size_t to, const char *key, const char *value, const char *after)
{
    char *out = NULL;
    size_t length;
    FILE *stream = open_memstream(&out, &length);
    if (!stream)
        return NULL;
    fwrite(text, 1, from, stream);
    if (key)
        fprintf(stream, "%s: ", key);
    write_quoted(stream, value);
    fprintf(stream, "%s%s", after, text + to);
    if (fclose(stream) == 0)
        return out;
    free(out);
    return NULL;
}

static char *edit_document(yaml_document_t *document, const char *text, const char *path, const char *value, bool add)
{
    const yaml_node_t *map = yaml_document_get_root_node(document), *node = NULL;
    const char *key = path;
    for (const char *dot; map && (dot = strchr(key, '.')); key = dot + 1)
        map = value_of(document, map, key, (size_t)(dot - key));
    if (!map || map->type != YAML_MAPPING_NODE)
        return NULL;
    node = value_of(document, map, key, strlen(key));
    if (node) {
        size_t from = byte_of(text, node->start_mark.index), to = byte_of(text, node->end_mark.index);
        bool ends_line = to > from && text[to - 1] == '\n';   // a block's end is the next token
        return spliced(text, from, to, NULL, value, ends_line ? "\n" : "");
    }
    if (!add)
        return NULL;
    size_t at = byte_of(text, map->start_mark.index);
    if (map->data.mapping.style == YAML_FLOW_MAPPING_STYLE)
        return spliced(text, at + 1, at + 1, key, value, map->data.mapping.pairs.start < map->data.mapping.pairs.top ? ", " : "");
    char indent[256] = "\n";   // the next key stands below this one
    size_t column = map->start_mark.column < sizeof indent - 2 ? map->start_mark.column : sizeof indent - 2;
    memset(indent + 1, ' ', column);
    return spliced(text, at, at, key, value, indent);
}

char *yaml_edit(const char *text, const char *path, const char *value, bool add)
{
    yaml_parser_t parser;
    yaml_document_t document;
    char *out = NULL;
    if (!yaml_parser_initialize(&parser))
        return NULL;
    yaml_parser_set_input_string(&parser, (const unsigned char *)text, strlen(text));
    if (yaml_parser_load(&parser, &document)) {
        out = edit_document(&document, text, path, value, add);
        yaml_document_delete(&document);
    }
    yaml_parser_delete(&parser);
    return out;
}
