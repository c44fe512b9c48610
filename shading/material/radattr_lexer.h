/** Words of the material language; used by the parser alone. */
#ifndef WEFT_SHADING_MATERIAL_RADATTR_LEXER_H
#define WEFT_SHADING_MATERIAL_RADATTR_LEXER_H

#include "shading/material/radattr.h"

typedef enum weft_rad_token {
    WEFT_TOKEN_END,
    WEFT_TOKEN_IDENT,
    WEFT_TOKEN_NUMBER,
    WEFT_TOKEN_STRING,
    WEFT_TOKEN_COLOUR,
    WEFT_TOKEN_COLON,
    WEFT_TOKEN_DEFINE, /* := */
    WEFT_TOKEN_EQUALS,
    WEFT_TOKEN_OPEN,
    WEFT_TOKEN_CLOSE,
    WEFT_TOKEN_LIST_OPEN,
    WEFT_TOKEN_LIST_CLOSE,
    WEFT_TOKEN_COMMA,
    WEFT_TOKEN_LIBRARY, /* <name> behind include */
    WEFT_TOKEN_BAD,     /* an error has been noted */
} weft_rad_token;

typedef struct weft_rad_lexer {
    const weft_source *source;
    weft_arena *arena;
    weft_diagnostics *diagnostics;
    size_t at; /* behind the current token */

    weft_rad_token token;
    weft_place place; /* of the token */
    double number;
    double colour[3];
    const char *text; /* of IDENT, STRING, LIBRARY without its marks; of NUMBER, COLOUR as spelt */

    /* comments that were passed and not yet taken: a comment anywhere is kept, whoever takes it */
    const char *before; /* those on lines of their own */
    const char *after;  /* the one on the line of the token before */
    bool blank_before;
} weft_rad_lexer;

/** Stands before the first token; call weft_rad_next() once. */
void weft_rad_lexer_init(weft_rad_lexer *lexer, const weft_source *source, weft_arena *arena,
                         weft_diagnostics *diagnostics);

/** Moves to the next token.  At the end of the text it stays at WEFT_TOKEN_END. */
void weft_rad_next(weft_rad_lexer *lexer);

/** Takes the comments in front of the current token, so that nobody else gets them. */
weft_rad_comments weft_rad_take_comments(weft_rad_lexer *lexer);

/** Takes the comment that stood on the line of the token before; NULL: none. */
const char *weft_rad_take_after(weft_rad_lexer *lexer);

/** What the token is called in a message: "'('", "a number", "the end of the file". */
const char *weft_rad_token_name(weft_rad_token token);

#endif
