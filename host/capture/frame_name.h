/**
 * Names of the frames of a set, made from a template as "{set}-{kind}-{light}-{bracket}".
 *
 * | field | becomes |
 * | --- | --- |
 * | {set} | the name of the sample |
 * | {kind} | light, ambient, dark or all |
 * | {light} | the light's number, two digits; not of other kinds |
 * | {bracket} | b0 for the shortest exposure of a bracket, b1, ...; not without a bracket |
 * | {exposure} | as asked of the camera: 0.04s |
 * | {index} | place in the order of capture, three digits from 000 |
 * | {date}, {time} | when the set was begun, UTC: 2026-11-23, 100000 |
 *
 * A field that a frame does not have vanishes together with the "-", "_", "." or "+" before it (at the
 * beginning of the name: after it).  set.json alone says what a file is; nothing reads names.
 */
#ifndef WEFT_HOST_CAPTURE_FRAME_NAME_H
#define WEFT_HOST_CAPTURE_FRAME_NAME_H

#include "core/error.h"
#include "host/set/set.h"

/** Room for a name with its suffix; longer ones are refused. */
#define WEFT_FRAME_NAME_SIZE 128
/** light-03.dng, light-03-b1.dng in a bracket, ambient.dng. */
#define WEFT_FRAME_NAME_DEFAULT "{kind}-{light}-{bracket}"

/** What a name may say. */
typedef struct weft_frame_facts {
    const char *set;     /* name of the sample; what no file name may hold becomes "-" */
    const char *created; /* "2026-11-23T10:00:00Z" */
    weft_frame_role role;
    int light;   /* -1: none */
    int bracket; /* 0: the shortest; -1: there is no bracket */
    int index;   /* 0: the set's first */
    double exposure_s;
} weft_frame_facts;

/** Whether the template can be used at all.
 *  @return WEFT_ERR_USAGE naming the field that there is not, or the letter that no file name may hold:
 *          allowed are letters, digits, - _ . + = , @ and UTF-8 beyond ASCII; not at its beginning - and . */
weft_err weft_frame_name_check(const char *template, weft_error *err);

/**
 * Makes a name.
 *
 * @param suffix  ".dng"; a template that ends in it does not get it twice
 * @return WEFT_ERR_USAGE when nothing is left of the template, or the name is too long
 */
weft_err weft_frame_name_make(const char *template, const weft_frame_facts *facts, const char *suffix,
                              char file[WEFT_FRAME_NAME_SIZE], weft_error *err);

/** Whether two names are one file on some disk: FAT, NTFS and macOS take large and small letters for one. */
bool weft_frame_name_equal(const char *a, const char *b);

#endif
