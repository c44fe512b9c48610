#include "host/rig/dslr_properties.h"

#include "host/rig/ptp_codes.h"

#include <stdio.h>
#include <string.h>

/* Shutter speeds: in 0.1 ms, and as fractions (numerator in the upper half); the last is bulb. */
static const uint32_t times[DSLR_N_EXPOSURES] = {
    2,     3,     4,      5,      6,      8,      10,     12,     15,         20,    25,
    31,    40,    50,     62,     80,     100,    125,    166,    200,        250,   333,
    400,   500,   666,    769,    1000,   1250,   1666,   2000,   2500,       3333,  4000,
    5000,  6250,  7692,   10000,  13000,  16000,  20000,  25000,  30000,      40000, 50000,
    60000, 80000, 100000, 130000, 150000, 200000, 250000, 300000, 0xffffffff,
};
static const uint32_t fractions[DSLR_N_EXPOSURES] = {
    69536,  68736,  68036,  67536,  67136,  66786,   66536,   66336,   66176,      66036,  65936,
    65856,  65786,  65736,  65696,  65661,  65636,   65616,   65596,   65586,      65576,  65566,
    65561,  65556,  65551,  65549,  65546,  65544,   65542,   65541,   65540,      65539,  655385,
    65538,  655376, 655373, 65537,  851978, 1048586, 131073,  1638410, 196609,     262145, 327681,
    393217, 524289, 655361, 851969, 983041, 1310721, 1638401, 1966081, 0xffffffff,
};

static const uint32_t compressions[] = {0, 1, 2, 4, 5, 6, 7};
static const uint32_t f_numbers[] = {140, 160, 180, 200, 220,  250,  280,  320,  350,  400,  450,  500, 560,
                                     630, 710, 800, 900, 1000, 1100, 1300, 1400, 1600, 1800, 2000, 2200};
static const uint32_t focus_modes[] = {1, 0x8010, 0x8011, 0x8012, 0x8013};
static const uint32_t programs[] = {1,      2,      3,      4,      0x8010, 0x8011, 0x8012,
                                    0x8013, 0x8014, 0x8016, 0x8017, 0x8018, 0x8019};
static const uint32_t speeds[] = {100,  125,  160,  200,  250,  320,  400,  500,  640,   800,   1000, 1250,
                                  1600, 2000, 2500, 3200, 4000, 5000, 6400, 8000, 10000, 12800, 25600};
static const uint32_t capture_modes[] = {1, 2, 0x8011, 0x8014, 0x8015, 0x8016};

/* A row: either a list of values or a range. */
typedef struct property {
    uint16_t code, type;
    bool writable;
    uint32_t initial;
    const uint32_t *list;
    int n_list;
    uint32_t min, max;
} property;

#define LIST(values) .list = (values), .n_list = sizeof(values) / sizeof *(values)

enum { EXPOSURE_TIME = 6, EXPOSURE = 12 };

static const property table[DSLR_N_PROPERTIES] = {
    {PTP_PROP_BATTERY, PTP_UINT8, false, 100, .max = 100},
    {PTP_PROP_IMAGE_SIZE, PTP_TEXT, true, 0, .max = 0},
    {PTP_PROP_COMPRESSION, PTP_UINT8, true, NIKON_JPEG_FINE, LIST(compressions)},
    {PTP_PROP_F_NUMBER, PTP_UINT16, false, 800, LIST(f_numbers)},
    {PTP_PROP_FOCAL_LENGTH, PTP_UINT32, false, 8500, .min = 8500, .max = 8500},
    {PTP_PROP_FOCUS_MODE, PTP_UINT16, false, 1, LIST(focus_modes)},
    [EXPOSURE_TIME] = {PTP_PROP_EXPOSURE_TIME, PTP_UINT32, true, 333, LIST(times)},
    {PTP_PROP_PROGRAM, PTP_UINT16, false, 1, LIST(programs)},
    {PTP_PROP_ISO, PTP_UINT16, true, 400, LIST(speeds)},
    {PTP_PROP_CAPTURE_MODE, PTP_UINT16, true, 1, LIST(capture_modes)},
    {NIKON_PROP_LONG_NR, PTP_UINT8, true, 0, .max = 1},
    {NIKON_PROP_BRACKETING, PTP_UINT8, true, 0, .max = 1},
    [EXPOSURE] = {NIKON_PROP_EXPOSURE, PTP_UINT32, true, 65566, LIST(fractions)},
    {NIKON_PROP_MAX_SHOTS, PTP_UINT8, false, 16, .max = 99},
    {NIKON_PROP_MEDIA, PTP_UINT8, true, 0, .max = 2},
    {NIKON_PROP_HDR, PTP_UINT8, true, 0, .max = 1},
    {NIKON_PROP_AF_MODE, PTP_UINT8, true, 3, .max = 4},
    {NIKON_PROP_AUTO_ISO, PTP_UINT8, true, 1, .max = 1},
    {NIKON_PROP_LIVE_VIEW, PTP_UINT8, false, 0, .max = 1},
    /* More of the body's list, for a client that looks at them. */
    {0xd070, PTP_UINT8, true, 2, .max = 3},         /* noise reduction at high ISO */
    {0xd08a, PTP_UINT8, true, 1, .max = 1},         /* release without a card */
    {0xd101, PTP_UINT8, false, 0, .max = 1},        /* on AC power */
    {0xd102, PTP_UINT8, false, 0, .max = 255},      /* warnings */
    {0xd1f1, PTP_UINT16, false, 903, .max = 65535}, /* pictures left on the card */
};

static int find(unsigned code)
{
    for (int i = 0; i < DSLR_N_PROPERTIES; i++)
        if (table[i].code == code)
            return i;
    return -1;
}

static int size_of(const property *row)
{
    return row->type == PTP_UINT8 ? 1 : row->type == PTP_UINT16 ? 2 : 4;
}

/* -1: not one of them */
static int index_of(const property *row, uint32_t value)
{
    for (int i = 0; i < row->n_list; i++)
        if (row->list[i] == value)
            return i;
    return -1;
}

void dslr_properties_init(dslr_properties *p, int width, int height)
{
    *p = (dslr_properties){0};
    for (int i = 0; i < DSLR_N_PROPERTIES; i++)
        p->value[i] = table[i].initial;
    snprintf(p->image_size, sizeof p->image_size, "%dx%d", width, height);
}

int dslr_property_codes(bool vendor, uint16_t codes[DSLR_N_PROPERTIES])
{
    int n = 0;
    for (int i = 0; i < DSLR_N_PROPERTIES; i++)
        if ((table[i].code >= 0xd000) == vendor)
            codes[n++] = table[i].code;
    return n;
}

uint32_t dslr_property_get(const dslr_properties *p, unsigned code)
{
    const int i = find(code);
    return i < 0 ? 0 : p->value[i];
}

/* The two spellings of the shutter speed are one dial. */
static void set(dslr_properties *p, int i, uint32_t value)
{
    p->value[i] = value;
    if (i == EXPOSURE_TIME)
        p->value[EXPOSURE] = fractions[index_of(&table[i], value)];
    if (i == EXPOSURE)
        p->value[EXPOSURE_TIME] = times[index_of(&table[i], value)];
}

static bool is_possible(const property *row, uint32_t value)
{
    return row->list ? index_of(row, value) >= 0 : value >= row->min && value <= row->max;
}

bool dslr_property_turn(dslr_properties *p, unsigned code, uint32_t value)
{
    const int i = find(code);
    if (i < 0 || table[i].type == PTP_TEXT || !is_possible(&table[i], value))
        return false;
    set(p, i, value);
    return true;
}

bool dslr_property_lock(dslr_properties *p, unsigned code, bool locked)
{
    const int i = find(code);
    if (i < 0)
        return false;
    p->locked[i] = locked;
    return true;
}

/* In the automatic modes of the dial the body chooses the shutter speed. */
static bool is_writable(const dslr_properties *p, int i)
{
    const bool manual = dslr_property_get(p, PTP_PROP_PROGRAM) == 1;
    return table[i].writable && !p->locked[i] && (manual || (i != EXPOSURE && i != EXPOSURE_TIME));
}

uint16_t dslr_property_read(const dslr_properties *p, unsigned code, ptp_writer *w)
{
    const int i = find(code);
    if (i < 0)
        return PTP_PROPERTY_NOT_SUPPORTED;
    if (table[i].type == PTP_TEXT)
        ptp_put_text(w, p->image_size);
    else
        ptp_put(w, p->value[i], size_of(&table[i]));
    return PTP_OK;
}

uint16_t dslr_property_describe(const dslr_properties *p, unsigned code, ptp_writer *w)
{
    enum { NO_FORM, RANGE, ENUMERATION };
    const int i = find(code);
    if (i < 0)
        return PTP_PROPERTY_NOT_SUPPORTED;
    const property *const row = &table[i];
    const int size = size_of(row);
    ptp_put(w, code, 2);
    ptp_put(w, row->type, 2);
    ptp_put(w, is_writable(p, i), 1);
    if (row->type == PTP_TEXT) {
        ptp_put_text(w, p->image_size);
        ptp_put_text(w, p->image_size);
        ptp_put(w, ENUMERATION, 1);
        ptp_put(w, 1, 2);
        ptp_put_text(w, p->image_size);
        return PTP_OK;
    }
    ptp_put(w, row->initial, size);
    ptp_put(w, p->value[i], size);
    ptp_put(w, row->list ? ENUMERATION : RANGE, 1);
    if (row->list)
        ptp_put(w, (uint64_t)row->n_list, 2);
    for (int k = 0; row->list && k < row->n_list; k++)
        ptp_put(w, row->list[k], size);
    if (!row->list) {
        ptp_put(w, row->min, size);
        ptp_put(w, row->max, size);
        ptp_put(w, 1, size); /* step */
    }
    return PTP_OK;
}

uint16_t dslr_property_write(dslr_properties *p, unsigned code, const uint8_t *bytes, size_t n)
{
    const int i = find(code);
    if (i < 0)
        return PTP_PROPERTY_NOT_SUPPORTED;
    if (!is_writable(p, i))
        return PTP_ACCESS_DENIED;
    if (table[i].type == PTP_TEXT)
        return PTP_OK; /* there is one size */
    if (n != (size_t)size_of(&table[i]))
        return PTP_INVALID_PROPERTY_VALUE;
    const uint32_t value = (uint32_t)ptp_get(bytes, size_of(&table[i]));
    if (!is_possible(&table[i], value))
        return PTP_INVALID_PROPERTY_VALUE;
    set(p, i, value);
    return PTP_OK;
}

bool dslr_exposure(const dslr_properties *p, uint32_t *numerator, uint32_t *denominator)
{
    const uint32_t value = p->value[EXPOSURE];
    *numerator = value >> 16;
    *denominator = value & 0xffff;
    return value != 0xffffffff;
}
