#include "shading/material/radattr_lexer.h"

#include "core/colour.h"
#include "core/text.h"

#include <string.h>

void weft_rad_lexer_init(weft_rad_lexer *lexer, const weft_source *source, weft_arena *arena,
                         weft_diagnostics *diagnostics)
{
    *lexer = (weft_rad_lexer){.source = source, .arena = arena, .diagnostics = diagnostics};
}

const char *weft_rad_token_name(weft_rad_token token)
{
    static const char *const names[] = {
        [WEFT_TOKEN_END] = "the end of the file",
        [WEFT_TOKEN_IDENT] = "a name",
        [WEFT_TOKEN_NUMBER] = "a number",
        [WEFT_TOKEN_STRING] = "a text",
        [WEFT_TOKEN_COLOUR] = "a colour",
        [WEFT_TOKEN_COLON] = "':'",
        [WEFT_TOKEN_DEFINE] = "':='",
        [WEFT_TOKEN_EQUALS] = "'='",
        [WEFT_TOKEN_OPEN] = "'('",
        [WEFT_TOKEN_CLOSE] = "')'",
        [WEFT_TOKEN_LIST_OPEN] = "'['",
        [WEFT_TOKEN_LIST_CLOSE] = "']'",
        [WEFT_TOKEN_COMMA] = "','",
        [WEFT_TOKEN_LIBRARY] = "a library file",
        [WEFT_TOKEN_BAD] = "something unreadable",
    };
    return names[token];
}

static bool is_letter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

static void bad(weft_rad_lexer *lexer, size_t begin, size_t end, const char *text)
{
    lexer->token = WEFT_TOKEN_BAD;
    lexer->place = (weft_place){lexer->source, begin, end - begin};
    weft_diagnose(lexer->diagnostics, WEFT_SEVERITY_ERROR, lexer->place, "%s", text);
}

static const char *joined(weft_rad_lexer *lexer, const char *head, const char *text, size_t n)
{
    if (!head)
        return weft_arena_text(lexer->arena, text, n, NULL);
    return weft_arena_printf(lexer->arena, NULL, "%s\n%.*s", head, (int)n, text);
}

/* Reads one comment at `at`; false when a slash-star never ends. */
static bool read_comment(weft_rad_lexer *lexer, bool own_line)
{
    const char *const text = lexer->source->text + lexer->at;
    size_t n;
    if (text[1] == '/') {
        n = strcspn(text, "\r\n");
    } else {
        const char *const end = strstr(text + 2, "*/");
        if (!end) {
            bad(lexer, lexer->at, lexer->at + 2, "this comment is never closed with */");
            return false;
        }
        n = (size_t)(end - text) + 2;
    }
    const char **const place = own_line ? &lexer->before : &lexer->after;
    *place = joined(lexer, *place, text, n);
    lexer->at += n;
    return true;
}

/* An empty line in front of everything, or between or behind comments: there it is an empty line of them. */
static void note_blank_line(weft_rad_lexer *lexer)
{
    if (lexer->before)
        lexer->before = joined(lexer, lexer->before, "", 0);
    else
        lexer->blank_before = true;
}

/* Passes white space and comments.  A comment on the line of the last token belongs to that one. */
static bool pass_blanks(weft_rad_lexer *lexer)
{
    const char *const text = lexer->source->text;
    bool own_line = lexer->at == 0;
    int newlines = 0;
    for (;;) {
        const char c = text[lexer->at];
        if (c == '\n') {
            own_line = true;
            if (++newlines == 2)
                note_blank_line(lexer);
            lexer->at++;
        } else if (c == ' ' || c == '\t' || c == '\r') {
            lexer->at++;
        } else if (c == '/' && (text[lexer->at + 1] == '/' || text[lexer->at + 1] == '*')) {
            if (!read_comment(lexer, own_line))
                return false;
            newlines = 0;
        } else {
            return true;
        }
    }
}

static void read_string(weft_rad_lexer *lexer, char close, weft_rad_token token)
{
    const char *const text = lexer->source->text;
    const size_t begin = lexer->at;
    size_t end = begin + 1;
    while (text[end] && text[end] != close && text[end] != '\n')
        end++;
    if (text[end] != close) {
        bad(lexer, begin, begin + 1, close == '"' ? "this text is never closed with '\"'" : "'>' is missing");
        return;
    }
    lexer->token = token;
    lexer->text = weft_arena_text(lexer->arena, text + begin + 1, end - begin - 1, NULL);
    lexer->at = end + 1;
}

static void read_colour(weft_rad_lexer *lexer)
{
    const char *const text = lexer->source->text + lexer->at;
    const size_t n = 1 + strspn(text + 1, "0123456789abcdefABCDEF");
    if (n != 7 || is_letter(text[n])) {
        bad(lexer, lexer->at, lexer->at + n, "a colour is # and six hex digits, as in #c84a32 (sRGB)");
        return;
    }
    for (int c = 0; c < 3; c++) {
        int level = 0;
        for (int k = 0; k < 2; k++) {
            const char digit = text[1 + 2 * c + k];
            level = 16 * level + (is_digit(digit) ? digit - '0' : (digit | 32) - 'a' + 10);
        }
        lexer->colour[c] = weft_srgb_decode(level / 255.0);
    }
    lexer->token = WEFT_TOKEN_COLOUR;
    lexer->text = weft_arena_text(lexer->arena, text, n, NULL);
    lexer->at += n;
}

/* Decimal only: "inf", "nan" and hex floats, which strtod takes, are no numbers here. */
static void read_number(weft_rad_lexer *lexer)
{
    const char *const text = lexer->source->text + lexer->at;
    size_t n = strspn(text, "+-");
    n += strspn(text + n, "0123456789.");
    if ((text[n] | 32) == 'e' &&
        (is_digit(text[n + 1]) || ((text[n + 1] == '-' || text[n + 1] == '+') && is_digit(text[n + 2]))))
        n += 2 + strspn(text + n + 2, "0123456789");
    char *const spelt = weft_arena_text(lexer->arena, text, n, NULL);
    if (is_letter(text[n]) || !spelt || !weft_text_to_double(spelt, &lexer->number)) {
        bad(lexer, lexer->at, lexer->at + n, "this is no number; write it as 0.25 or 2.5e-3");
        return;
    }
    lexer->token = WEFT_TOKEN_NUMBER;
    lexer->text = spelt;
    lexer->at += n;
}

static void read_ident(weft_rad_lexer *lexer)
{
    const char *const text = lexer->source->text + lexer->at;
    size_t n = 1;
    while (is_letter(text[n]) || is_digit(text[n]))
        n++;
    lexer->token = WEFT_TOKEN_IDENT;
    lexer->text = weft_arena_text(lexer->arena, text, n, NULL);
    lexer->at += n;
}

static void read_mark(weft_rad_lexer *lexer)
{
    static const struct {
        char mark;
        weft_rad_token token;
    } marks[] = {{':', WEFT_TOKEN_COLON}, {'=', WEFT_TOKEN_EQUALS},    {'(', WEFT_TOKEN_OPEN},
                 {')', WEFT_TOKEN_CLOSE}, {'[', WEFT_TOKEN_LIST_OPEN}, {']', WEFT_TOKEN_LIST_CLOSE},
                 {',', WEFT_TOKEN_COMMA}};
    const char *const text = lexer->source->text + lexer->at;
    if (text[0] == ':' && text[1] == '=') {
        lexer->token = WEFT_TOKEN_DEFINE;
        lexer->at += 2;
        return;
    }
    for (size_t i = 0; i < sizeof marks / sizeof marks[0]; i++)
        if (text[0] == marks[i].mark) {
            lexer->token = marks[i].token;
            lexer->at++;
            return;
        }
    size_t n = 1; /* the whole character, when it is one beyond ASCII */
    while (((unsigned char)text[n] & 0xc0) == 0x80)
        n++;
    bad(lexer, lexer->at, lexer->at + n, "this character has no meaning here");
}

void weft_rad_next(weft_rad_lexer *lexer)
{
    if (!pass_blanks(lexer))
        return;
    const char *const text = lexer->source->text + lexer->at;
    const size_t begin = lexer->at;
    const char c = text[0];
    if (lexer->at >= lexer->source->n)
        lexer->token = WEFT_TOKEN_END;
    else if (c == '"')
        read_string(lexer, '"', WEFT_TOKEN_STRING);
    else if (c == '<')
        read_string(lexer, '>', WEFT_TOKEN_LIBRARY);
    else if (c == '#')
        read_colour(lexer);
    else if (is_digit(c) || c == '-' || c == '+' || c == '.')
        read_number(lexer);
    else if (is_letter(c))
        read_ident(lexer);
    else
        read_mark(lexer);
    if (lexer->token != WEFT_TOKEN_BAD)
        lexer->place = (weft_place){lexer->source, begin, lexer->at - begin};
}

weft_rad_comments weft_rad_take_comments(weft_rad_lexer *lexer)
{
    const weft_rad_comments taken = {
        .before = !lexer->after   ? lexer->before
                  : lexer->before ? joined(lexer, lexer->after, lexer->before, strlen(lexer->before))
                                  : lexer->after,
        .blank_before = lexer->blank_before,
    };
    lexer->before = lexer->after = NULL;
    lexer->blank_before = false;
    return taken;
}

const char *weft_rad_take_after(weft_rad_lexer *lexer)
{
    const char *const taken = lexer->after;
    lexer->after = NULL;
    return taken;
}
