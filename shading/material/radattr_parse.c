#include "shading/material/radattr_lexer.h"

#include <string.h>

/* Every parse function leaves the lexer behind what it read, and returns false once an error is noted. */

static bool fail(weft_rad_lexer *lexer, const char *wanted)
{
    if (lexer->token != WEFT_TOKEN_BAD) /* that one has been said */
        weft_diagnose(lexer->diagnostics, WEFT_SEVERITY_ERROR, lexer->place, "%s is wanted here, not %s",
                      wanted, weft_rad_token_name(lexer->token));
    return false;
}

static bool expect(weft_rad_lexer *lexer, weft_rad_token token)
{
    if (lexer->token != token)
        return fail(lexer, weft_rad_token_name(token));
    weft_rad_next(lexer);
    return true;
}

static bool parse_value(weft_rad_lexer *lexer, int depth, weft_rad_value *value);

/* ":" ident "=" value; the colon stands here. */
static bool parse_member(weft_rad_lexer *lexer, int depth, weft_rad_member **tail, weft_rad_record *record)
{
    weft_rad_member *const member = weft_arena_alloc(lexer->arena, sizeof *member, NULL);
    weft_rad_value *const value = weft_arena_alloc(lexer->arena, sizeof *value, NULL);
    if (!member || !value)
        return false;
    member->comments = weft_rad_take_comments(lexer);
    weft_rad_next(lexer);
    if (lexer->token != WEFT_TOKEN_IDENT)
        return fail(lexer, "the name of a property");
    member->name = lexer->text;
    member->place = lexer->place;
    member->value = value;
    const weft_rad_member *const earlier = weft_rad_find(record, member->name);
    if (earlier) {
        int line, column;
        weft_place_position(earlier->place, &line, &column);
        weft_diagnose(lexer->diagnostics, WEFT_SEVERITY_ERROR, member->place,
                      "'%s' has been set in line %d; keep one of the two", member->name, line);
        return false;
    }
    weft_rad_next(lexer);
    if (!expect(lexer, WEFT_TOKEN_EQUALS) || !parse_value(lexer, depth, value))
        return false;
    member->comments.after = weft_rad_take_after(lexer);
    *tail = member;
    return true;
}

/* "(" [ basename ] { member } ")" */
static bool parse_record(weft_rad_lexer *lexer, int depth, bool needs_base, weft_rad_record *record)
{
    const weft_place open = lexer->place;
    if (!expect(lexer, WEFT_TOKEN_OPEN))
        return false;
    if (lexer->token == WEFT_TOKEN_IDENT) {
        record->base = lexer->text;
        record->base_place = lexer->place;
        weft_rad_next(lexer);
    } else if (needs_base) {
        return fail(lexer, "what it derives from (opaquematerial, or another material)");
    }
    weft_rad_member **tail = &record->members;
    while (lexer->token == WEFT_TOKEN_COLON) {
        if (!parse_member(lexer, depth, tail, record))
            return false;
        tail = &(*tail)->next;
    }
    record->last_comment = weft_rad_take_comments(lexer).before;
    if (lexer->token == WEFT_TOKEN_END || lexer->token == WEFT_TOKEN_DEFINE) {
        weft_diagnose(lexer->diagnostics, WEFT_SEVERITY_ERROR, open, "this '(' is never closed");
        return false;
    }
    if (lexer->token != WEFT_TOKEN_CLOSE)
        return fail(lexer, "a property (':name = value') or ')'");
    weft_rad_next(lexer);
    return true;
}

/* "[" { value [ "," ] } "]" */
static bool parse_list(weft_rad_lexer *lexer, int depth, weft_rad_value *list)
{
    const weft_place open = lexer->place;
    weft_rad_next(lexer);
    weft_rad_value **tail = &list->items;
    while (lexer->token != WEFT_TOKEN_LIST_CLOSE) {
        if (lexer->token == WEFT_TOKEN_END) {
            weft_diagnose(lexer->diagnostics, WEFT_SEVERITY_ERROR, open, "this '[' is never closed");
            return false;
        }
        weft_rad_value *const item = weft_arena_alloc(lexer->arena, sizeof *item, NULL);
        if (!item)
            return false;
        item->comments = weft_rad_take_comments(lexer);
        if (!parse_value(lexer, depth, item))
            return false;
        if (lexer->token == WEFT_TOKEN_COMMA)
            weft_rad_next(lexer);
        item->comments.after = weft_rad_take_after(lexer);
        *tail = item;
        tail = &item->next;
    }
    list->record.last_comment = weft_rad_take_comments(lexer).before;
    weft_rad_next(lexer);
    return true;
}

static bool parse_value(weft_rad_lexer *lexer, int depth, weft_rad_value *value)
{
    const weft_place start = lexer->place;
    value->text = lexer->text;
    value->number = lexer->number;
    value->place = start;
    bool whole = true;
    if ((lexer->token == WEFT_TOKEN_OPEN || lexer->token == WEFT_TOKEN_LIST_OPEN) &&
        depth >= WEFT_RAD_MAX_DEPTH) {
        weft_diagnose(lexer->diagnostics, WEFT_SEVERITY_ERROR, start, "nested deeper than %d",
                      WEFT_RAD_MAX_DEPTH);
        return false;
    }
    switch (lexer->token) {
    case WEFT_TOKEN_NUMBER:
        value->kind = WEFT_RAD_NUMBER;
        break;
    case WEFT_TOKEN_STRING:
        value->kind = WEFT_RAD_TEXT;
        break;
    case WEFT_TOKEN_COLOUR:
        value->kind = WEFT_RAD_COLOUR;
        memcpy(value->colour, lexer->colour, sizeof value->colour);
        break;
    case WEFT_TOKEN_IDENT:
        value->flag = strcmp(lexer->text, "true") == 0;
        value->kind = value->flag || strcmp(lexer->text, "false") == 0 ? WEFT_RAD_FLAG : WEFT_RAD_NAME;
        break;
    case WEFT_TOKEN_OPEN:
        value->kind = WEFT_RAD_RECORD;
        whole = parse_record(lexer, depth + 1, false, &value->record);
        return whole;
    case WEFT_TOKEN_LIST_OPEN:
        value->kind = WEFT_RAD_LIST;
        return parse_list(lexer, depth + 1, value);
    default:
        return fail(lexer, "a value");
    }
    weft_rad_next(lexer);
    return whole;
}

static bool parse_include(weft_rad_lexer *lexer, weft_rad_item *item)
{
    item->is_include = true;
    weft_rad_next(lexer);
    if (lexer->token != WEFT_TOKEN_STRING && lexer->token != WEFT_TOKEN_LIBRARY)
        return fail(lexer, "a file, \"beside.radattr\" or <library.radattr>,");
    item->from_library = lexer->token == WEFT_TOKEN_LIBRARY;
    item->name = lexer->text;
    item->place = lexer->place;
    weft_rad_next(lexer);
    return true;
}

/* ":" ident ":=" record */
static bool parse_definition(weft_rad_lexer *lexer, weft_rad_item *item)
{
    weft_rad_next(lexer);
    if (lexer->token != WEFT_TOKEN_IDENT)
        return fail(lexer, "the name of a material");
    item->name = lexer->text;
    item->place = lexer->place;
    weft_rad_next(lexer);
    return expect(lexer, WEFT_TOKEN_DEFINE) && parse_record(lexer, 0, true, &item->record);
}

static bool parse_item(weft_rad_lexer *lexer, weft_rad_item *item)
{
    item->comments = weft_rad_take_comments(lexer);
    bool good;
    if (lexer->token == WEFT_TOKEN_COLON)
        good = parse_definition(lexer, item);
    else if (lexer->token == WEFT_TOKEN_IDENT && strcmp(lexer->text, "include") == 0)
        good = parse_include(lexer, item);
    else
        return fail(lexer, "a material (':name := ( base ... )') or an include");
    if (good)
        item->comments.after = weft_rad_take_after(lexer);
    return good;
}

weft_rad_file *weft_rad_parse(const weft_source *source, weft_arena *arena, weft_diagnostics *diagnostics)
{
    weft_rad_file *const file = weft_arena_alloc(arena, sizeof *file, NULL);
    if (!file)
        return NULL;
    file->source = source;
    weft_rad_lexer lexer;
    weft_rad_lexer_init(&lexer, source, arena, diagnostics);
    weft_rad_next(&lexer);
    weft_rad_item **tail = &file->items;
    while (lexer.token != WEFT_TOKEN_END) {
        weft_rad_item *const item = weft_arena_alloc(arena, sizeof *item, NULL);
        if (!item || !parse_item(&lexer, item))
            return NULL;
        *tail = item;
        tail = &item->next;
    }
    file->last_comment = weft_rad_take_comments(&lexer).before;
    return file;
}

weft_rad_member *weft_rad_find(const weft_rad_record *record, const char *name)
{
    for (weft_rad_member *m = record->members; m; m = m->next)
        if (strcmp(m->name, name) == 0)
            return m;
    return NULL;
}

const char *weft_rad_kind_name(weft_rad_kind kind)
{
    static const char *const names[] = {
        [WEFT_RAD_FLAG] = "true or false", [WEFT_RAD_NUMBER] = "a number", [WEFT_RAD_TEXT] = "a text",
        [WEFT_RAD_COLOUR] = "a colour",    [WEFT_RAD_NAME] = "a name",     [WEFT_RAD_LIST] = "a list",
        [WEFT_RAD_RECORD] = "a record",
    };
    return names[kind];
}
