/**
 * Numbers of the Picture Transfer Protocol that the virtual DSLR speaks.
 *
 * Sources: PIMA 15740:2000 (ISO 15740) for the standard ones; CIPA DC-005-2005 for PTP over TCP; what a Nikon
 * D5100 with firmware 1.01 lists of itself, as printed by libgphoto2 (camlibs/ptp2/cameras/nikon-d5100.txt).
 */
#ifndef WEFT_HOST_RIG_PTP_CODES_H
#define WEFT_HOST_RIG_PTP_CODES_H

/* Operations. */
#define PTP_GET_DEVICE_INFO    0x1001
#define PTP_OPEN_SESSION       0x1002
#define PTP_CLOSE_SESSION      0x1003
#define PTP_GET_STORAGE_IDS    0x1004
#define PTP_GET_STORAGE_INFO   0x1005
#define PTP_GET_NUM_OBJECTS    0x1006
#define PTP_GET_OBJECT_HANDLES 0x1007
#define PTP_GET_OBJECT_INFO    0x1008
#define PTP_GET_OBJECT         0x1009
#define PTP_DELETE_OBJECT      0x100b
#define PTP_GET_PROPERTY_DESC  0x1014
#define PTP_GET_PROPERTY_VALUE 0x1015
#define PTP_SET_PROPERTY_VALUE 0x1016
#define PTP_GET_PARTIAL_OBJECT 0x101b
#define NIKON_CAPTURE_SDRAM    0x90c0
#define NIKON_SET_CONTROL_MODE 0x90c2
#define NIKON_DELETE_SDRAM     0x90c3
#define NIKON_GET_EVENT        0x90c7
#define NIKON_DEVICE_READY     0x90c8
#define NIKON_GET_VENDOR_PROPS 0x90ca
#define NIKON_AF_CAPTURE_SDRAM 0x90cb
#define NIKON_END_LIVE_VIEW    0x9202
#define NIKON_CAPTURE_TO_MEDIA 0x9207

/* Responses. */
#define PTP_OK                      0x2001
#define PTP_GENERAL_ERROR           0x2002
#define PTP_SESSION_NOT_OPEN        0x2003
#define PTP_OPERATION_NOT_SUPPORTED 0x2005
#define PTP_INCOMPLETE_TRANSFER     0x2007
#define PTP_INVALID_STORAGE_ID      0x2008
#define PTP_INVALID_OBJECT_HANDLE   0x2009
#define PTP_PROPERTY_NOT_SUPPORTED  0x200a
#define PTP_STORE_FULL              0x200c
#define PTP_ACCESS_DENIED           0x200f
#define PTP_STORE_NOT_AVAILABLE     0x2013
#define PTP_DEVICE_BUSY             0x2019
#define PTP_INVALID_PROPERTY_VALUE  0x201c
#define PTP_SESSION_ALREADY_OPEN    0x201e

/* Events. */
#define PTP_EVENT_CAPTURE_COMPLETE   0x400d
#define NIKON_EVENT_OBJECT_IN_SDRAM  0xc101
#define NIKON_EVENT_CAPTURE_COMPLETE 0xc102

/* Properties. */
#define PTP_PROP_BATTERY       0x5001
#define PTP_PROP_IMAGE_SIZE    0x5003
#define PTP_PROP_COMPRESSION   0x5004
#define PTP_PROP_F_NUMBER      0x5007
#define PTP_PROP_FOCAL_LENGTH  0x5008
#define PTP_PROP_FOCUS_MODE    0x500a
#define PTP_PROP_EXPOSURE_TIME 0x500d
#define PTP_PROP_PROGRAM       0x500e
#define PTP_PROP_ISO           0x500f
#define PTP_PROP_CAPTURE_MODE  0x5013
#define NIKON_PROP_LONG_NR     0xd06b
#define NIKON_PROP_BRACKETING  0xd0c0
#define NIKON_PROP_EXPOSURE    0xd100
#define NIKON_PROP_MAX_SHOTS   0xd103
#define NIKON_PROP_MEDIA       0xd10b
#define NIKON_PROP_HDR         0xd130
#define NIKON_PROP_AF_MODE     0xd161
#define NIKON_PROP_AUTO_ISO    0xd16a
#define NIKON_PROP_LIVE_VIEW   0xd1a2

/* Object formats. */
#define PTP_FORMAT_UNDEFINED 0x3000 /* what Nikon calls a NEF */
#define PTP_FORMAT_FOLDER    0x3001
#define PTP_FORMAT_JPEG      0x3801

/* Data types. */
#define PTP_UINT8  0x0002
#define PTP_UINT16 0x0004
#define PTP_UINT32 0x0006
#define PTP_TEXT   0xffff

/* Values. */
#define PTP_VENDOR_NIKON   0x0000000a
#define NIKON_SDRAM_HANDLE 0xffff0001u
#define NIKON_JPEG_FINE    2
#define NIKON_NEF          4
#define NIKON_NEF_AND_JPEG 5

#endif
