/**
 * What a baked material still has of the U3M it was made from: those parts are passed on as they are, their
 * pictures byte for byte; what differs is written anew.
 *
 * Differs is what a bake's half floats can tell: more than a thousandth.
 */
#ifndef WEFT_SHADING_U3M_U3M_KEEP_H
#define WEFT_SHADING_U3M_U3M_KEEP_H

#include "shading/u3m/u3m_document.h"

typedef struct weft_u3m_keep {
    weft_u3m *source;
    bool changed[WEFT_BAKED_COUNT]; /* the quantity is no longer the source's */
    bool is_metal;                  /* the colour is also that of F0 */
    bool same_name;                 /* the material has the source's name */
    bool same_physics;              /* and its thickness and weight */
} weft_u3m_keep;

/** Opens baked->u3m and compares.  @return as weft_u3m_open() and weft_u3m_bake() */
weft_err weft_u3m_keep_open(const weft_baked *baked, weft_u3m_keep *keep, weft_error *err);
/** `{0}` is fine. */
void weft_u3m_keep_close(weft_u3m_keep *keep);

/** Whether a parameter ("roughness") is passed on as it is. */
bool weft_u3m_keeps(const weft_u3m_keep *keep, const char *key);
/** Whether all is: the very document. */
bool weft_u3m_keeps_all(const weft_u3m_keep *keep);

/** A copy of the source's document, of version 1.1 when anything of it changes; NULL without memory. */
json_t *weft_u3m_keep_document(const weft_u3m_keep *keep);

/** Whether a file of the source still belongs to the new document: all do but the old document and pictures
 * of parameters that changed, unless a text of the new one names them. */
bool weft_u3m_keeps_file(const weft_u3m_keep *keep, int index, const json_t *document);

/** A name as one of the language: letters, digits and underscores, a letter first. */
void weft_u3m_identifier(const char *name, char *identifier, size_t size);

#endif
