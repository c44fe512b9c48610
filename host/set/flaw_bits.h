/** Bits of flaws.png (docs/formats.md). */
#ifndef WEFT_HOST_SET_FLAW_BITS_H
#define WEFT_HOST_SET_FLAW_BITS_H

typedef enum weft_flaw {
    WEFT_FLAW_TEAR = 1,   /* a hole that does not belong to the cloth's pattern */
    WEFT_FLAW_CREASE = 2, /* the cloth is folded sharply */
    WEFT_FLAW_LINT = 4    /* a loose fibre lies on it */
} weft_flaw;

#define WEFT_N_FLAWS 3

#endif
