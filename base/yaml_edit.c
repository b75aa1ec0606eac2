#include "base/yaml_edit.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

// Converts a libyaml mark, which counts characters without the byte-order mark, to a byte offset.
static size_t byte_of(const char *text, size_t characters)
{
    size_t at = strncmp(text, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
    for (; text[at] && characters > 0; characters--)
        for (at++; ((unsigned char)text[at] & 0xC0) == 0x80;)
            at++;
    return at;
}

// An item of a list by its index, counted from 0.
static yaml_node_t *item_of(yaml_document_t *document, const yaml_node_t *list, const char *number)
{
    char *end;
    long index = *number >= '0' && *number <= '9' ? strtol(number, &end, 10) : -1;
    bool whole = index >= 0 && (*end == '.' || !*end) && index < list->data.sequence.items.top - list->data.sequence.items.start;
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

// Replaces the bytes from `from` to `to` by `before`, the value (quoted if `is_quoted`) and `after`.
static char *spliced(const char *text, size_t from, size_t to, const char *before, const char *value, bool is_quoted, const char *after)
{
    char *out = NULL;
    size_t length;
    FILE *stream = open_memstream(&out, &length);
    if (!stream)
        return NULL;
    fwrite(text, 1, from, stream);
    fputs(before, stream);
    if (is_quoted)
        write_quoted(stream, value);
    else
        fputs(value, stream);
    fprintf(stream, "%s%s", after, text + to);
    if (fclose(stream) == 0)
        return out;
    free(out);
    return NULL;
}

// Finds the map or list that contains the last key of a path and sets *key to that key; NULL if it does not exist.
static const yaml_node_t *parent_of(yaml_document_t *document, const char *path, const char **key)
{
    const yaml_node_t *map = yaml_document_get_root_node(document);
    *key = path;
    for (const char *dot; map && (dot = strchr(*key, '.')); *key = dot + 1)
        map = value_of(document, map, *key, (size_t)(dot - *key));
    return map && map->type != YAML_SCALAR_NODE ? map : NULL;
}

// Adds a missing key before the other keys of its map.
static char *with_key(const char *text, const yaml_node_t *map, const char *key, const char *opening, const char *value, bool is_quoted, const char *closing)
{
    char before[256], after[300] = "";
    size_t at = byte_of(text, map->start_mark.index);
    bool is_flow = map->data.mapping.style == YAML_FLOW_MAPPING_STYLE;
    if ((size_t)snprintf(before, sizeof before, "%s: %s", key, opening) >= sizeof before)
        return NULL;
    if (is_flow) {
        snprintf(after, sizeof after, "%s%s", closing, map->data.mapping.pairs.start < map->data.mapping.pairs.top ? ", " : "");
        return spliced(text, at + 1, at + 1, before, value, is_quoted, after);
    }
    // the next key is placed below this one
    int column = map->start_mark.column < 250 ? (int)map->start_mark.column : 250;
    snprintf(after, sizeof after, "%s\n%*s", closing, column, "");
    return spliced(text, at, at, before, value, is_quoted, after);
}

static size_t end_of_block(const char *text, size_t from, size_t to);

typedef enum { EDIT_SCALAR, EDIT_FLOW, EDIT_ITEM } EditKind;     // a scalar, any value in flow style, an item appended to a list

static char *edit_document(yaml_document_t *document, const char *text, const char *path, const char *value, bool add, EditKind kind)
{
    const char *key;
    const yaml_node_t *map = parent_of(document, path, &key), *node = map ? value_of(document, map, key, strlen(key)) : NULL;
    if (!node)
        return map && map->type == YAML_MAPPING_NODE && add ? with_key(text, map, key, "", value, kind == EDIT_SCALAR, "") : NULL;
    size_t from = byte_of(text, node->start_mark.index), to = byte_of(text, node->end_mark.index);
    bool is_block = (node->type == YAML_MAPPING_NODE && node->data.mapping.style == YAML_BLOCK_MAPPING_STYLE) ||
                    (node->type == YAML_SEQUENCE_NODE && node->data.sequence.style == YAML_BLOCK_SEQUENCE_STYLE);
    if (is_block)
        to = end_of_block(text, from, to);
    bool ends_line = to > from && text[to - 1] == '\n';   // the end mark of a block value is the next token
    // an empty value begins directly after its colon
    return spliced(text, from, to, from == to ? " " : "", value, kind == EDIT_SCALAR, ends_line ? "\n" : "");
}

// The end of the last line of the last item: comments and blank lines after it belong to what follows the list.
static size_t end_of_block(const char *text, size_t from, size_t to)
{
    size_t end = from;
    while (from < to) {
        size_t line = strcspn(text + from, "\n"), blank = strspn(text + from, " \t\r");
        if (from + blank < to && blank < line && text[from + blank] != '#')
            end = from + line;
        from += line + 1;
    }
    return end;
}

static char *append_item(yaml_document_t *document, const char *text, const char *path, const char *item)
{
    const char *key;
    const yaml_node_t *map = parent_of(document, path, &key), *list = map ? value_of(document, map, key, strlen(key)) : NULL;
    if (!list)
        return map && map->type == YAML_MAPPING_NODE ? with_key(text, map, key, "[", item, false, "]") : NULL;
    if (list->type != YAML_SEQUENCE_NODE)
        return NULL;
    size_t from = byte_of(text, list->start_mark.index), to = byte_of(text, list->end_mark.index);
    if (list->data.sequence.style == YAML_FLOW_SEQUENCE_STYLE)
        return spliced(text, to - 1, to - 1, list->data.sequence.items.start < list->data.sequence.items.top ? ", " : "", item, false, "");
    char before[300];
    int column = list->start_mark.column < 250 ? (int)list->start_mark.column : 250;
    size_t end = end_of_block(text, from, to);
    snprintf(before, sizeof before, "\n%*s- ", column, "");
    return spliced(text, end, end, before, item, false, "");
}

static bool is_at_end(yaml_parser_t *parser)
{
    yaml_document_t next;
    if (!yaml_parser_load(parser, &next))
        return false;
    bool ended = !yaml_document_get_root_node(&next);
    yaml_document_delete(&next);
    return ended;
}

// Loads the only document of a text; the caller deletes it.
static bool load(const char *text, yaml_document_t *document)
{
    yaml_parser_t parser;
    if (!yaml_parser_initialize(&parser))
        return false;
    yaml_parser_set_input_string(&parser, (const unsigned char *)text, strlen(text));
    bool loaded = yaml_parser_load(&parser, document), good = loaded && is_at_end(&parser);
    if (loaded && !good)
        yaml_document_delete(document);
    yaml_parser_delete(&parser);
    return good;
}

enum { DEEPEST = 100 };

static bool same_value(yaml_document_t *a, const yaml_node_t *x, yaml_document_t *b, const yaml_node_t *y, int depth)
{
    if (!x || !y || x->type != y->type || depth > DEEPEST)
        return false;
    if (x->type == YAML_SCALAR_NODE)
        return x->data.scalar.length == y->data.scalar.length && !memcmp(x->data.scalar.value, y->data.scalar.value, x->data.scalar.length);
    bool is_list = x->type == YAML_SEQUENCE_NODE;
    long count = is_list ? x->data.sequence.items.top - x->data.sequence.items.start : x->data.mapping.pairs.top - x->data.mapping.pairs.start;
    if (count != (is_list ? y->data.sequence.items.top - y->data.sequence.items.start : y->data.mapping.pairs.top - y->data.mapping.pairs.start))
        return false;
    for (long i = 0; i < count; i++) {
        const yaml_node_pair_t *p = is_list ? NULL : &x->data.mapping.pairs.start[i], *q = is_list ? NULL : &y->data.mapping.pairs.start[i];
        int m = is_list ? x->data.sequence.items.start[i] : p->value, n = is_list ? y->data.sequence.items.start[i] : q->value;
        if (!same_value(a, yaml_document_get_node(a, m), b, yaml_document_get_node(b, n), depth + 1) ||
            (!is_list && !same_value(a, yaml_document_get_node(a, p->key), b, yaml_document_get_node(b, q->key), depth + 1)))
            return false;
    }
    return true;
}

static bool is_flow_value(yaml_document_t *document, const yaml_node_t *node, const char *flow)
{
    yaml_document_t wanted;
    if (!load(flow, &wanted))
        return false;
    bool good = same_value(document, node, &wanted, yaml_document_get_root_node(&wanted), 0);
    yaml_document_delete(&wanted);
    return good;
}

// True if the edited text has the intended value. Aliases of the replaced value, tags, and keys that begin with `?` can give a different value or invalid YAML.
static bool has_value(const char *text, const char *path, const char *value, EditKind kind)
{
    yaml_document_t document;
    const char *key;
    if (!load(text, &document))
        return false;
    const yaml_node_t *map = parent_of(&document, path, &key), *node = map ? value_of(&document, map, key, strlen(key)) : NULL;
    bool good = node && (kind == EDIT_ITEM   ? node->type == YAML_SEQUENCE_NODE
                         : kind == EDIT_FLOW ? is_flow_value(&document, node, value)
                                             : node->type == YAML_SCALAR_NODE && !strcmp((const char *)node->data.scalar.value, value));
    yaml_document_delete(&document);
    return good;
}

static char *edit(const char *text, const char *path, const char *value, bool add, EditKind kind)
{
    yaml_document_t document;
    if (!load(text, &document))
        return NULL;
    char *out = kind == EDIT_ITEM ? append_item(&document, text, path, value) : edit_document(&document, text, path, value, add, kind);
    yaml_document_delete(&document);
    if (out && has_value(out, path, value, kind))
        return out;
    free(out);
    return NULL;
}

char *yaml_edit(const char *text, const char *path, const char *value, bool add) { return edit(text, path, value, add, EDIT_SCALAR); }

char *yaml_edit_flow(const char *text, const char *path, const char *flow, bool add) { return edit(text, path, flow, add, EDIT_FLOW); }

char *yaml_edit_append(const char *text, const char *path, const char *item) { return edit(text, path, item, true, EDIT_ITEM); }
