/** weft preview --turntable and --sweep: many pictures, as files or as one animated WebP, which can be
 * resumed. */
#ifndef WEFT_HOST_CLI_PREVIEW_SEQUENCE_H
#define WEFT_HOST_CLI_PREVIEW_SEQUENCE_H

#include "host/cli/command.h"
#include "shading/preview/preview.h"
#include "shading/preview/tone.h"

typedef struct weft_preview_sequence {
    const char *output; /* NAME.webp: one file; else NAME-000.png, NAME-001.png, ... */
    int n_frames;       /* 1..999 */
    bool turntable;     /* the sample goes once round; else the lamps do, about the z axis */
    bool resume;        /* keep the frames that an earlier run has left */
    bool temporal;      /* shadows remember the frame before */
    double frames_per_s;
    int quality; /* of WebP, 100 is lossless */
    weft_tone tone;
} weft_preview_sequence;

typedef struct weft_preview_sequence_report {
    int rendered, kept;
    double seconds; /* of rendering */
} weft_preview_sequence_report;

/**
 * Renders what is missing.
 *
 * Beside the frames lies a note, NAME.sequence.json, with the SHA-256 of all that decides them (maps, model,
 * lamps, surroundings, view, number); frames are kept only under the same hash.  Frames of a WebP lie in
 * NAME.webp.frames, which goes when the file is there.
 *
 * @return WEFT_ERR_EXISTS without --force and --resume; WEFT_ERR_MISMATCH when the frames there are of other
 *         options; WEFT_ERR_CANCELLED with all finished frames in place; what rendering and writing say
 */
weft_err weft_preview_sequence_render(const weft_invocation *inv, const weft_preview_sequence *sequence,
                                      const weft_preview_surface *surface, const weft_preview_view *view,
                                      weft_preview_sequence_report *report, weft_error *err);

#endif
