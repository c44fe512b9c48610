/**
 * The settings of the virtual DSLR: the properties of a Nikon D5100 (firmware 1.01) that matter for a raw
 * photograph, with their types, ranges and lists as that body reports them.
 */
#ifndef WEFT_HOST_RIG_DSLR_PROPERTIES_H
#define WEFT_HOST_RIG_DSLR_PROPERTIES_H

#include "host/rig/ptp_pack.h"

enum { DSLR_N_PROPERTIES = 24, DSLR_N_EXPOSURES = 53 };

/** Values now.  Zeroed, then dslr_properties_init(). */
typedef struct dslr_properties {
    uint32_t value[DSLR_N_PROPERTIES];
    bool locked[DSLR_N_PROPERTIES]; /* the client's changes are refused */
    char image_size[16];            /* "4928x3264" */
} dslr_properties;

void dslr_properties_init(dslr_properties *p, int width, int height);

/** The codes of the standard properties, or of the vendor's.  @return how many; `codes` has room for all */
int dslr_property_codes(bool vendor, uint16_t codes[DSLR_N_PROPERTIES]);

/** The value, or 0 for an unknown code. */
uint32_t dslr_property_get(const dslr_properties *p, unsigned code);

/** Changes a value as the body's own buttons and dials do: also what a client may not change.
 *  @return false for an unknown code or a value that the body does not have */
bool dslr_property_turn(dslr_properties *p, unsigned code, uint32_t value);

/** Refuses (or accepts again) changes by the client.  @return false for an unknown code */
bool dslr_property_lock(dslr_properties *p, unsigned code, bool locked);

/** What the operations answer: a response code, and the dataset in `w`. */
uint16_t dslr_property_describe(const dslr_properties *p, unsigned code, ptp_writer *w);
uint16_t dslr_property_read(const dslr_properties *p, unsigned code, ptp_writer *w);
uint16_t dslr_property_write(dslr_properties *p, unsigned code, const uint8_t *bytes, size_t n);

/** The shutter speed as a fraction of seconds.  @return false for bulb */
bool dslr_exposure(const dslr_properties *p, uint32_t *numerator, uint32_t *denominator);

#endif
