# The C libraries, their files, and the flags every build of them shares. base is what both stand on; bslam is
# the estimator, vision the way from images to sightings: neither needs the other. link is the serial
# protocol.

library_files = $(sort $(foreach folder,$(1),$(wildcard $(addsuffix .$(2),firmware/$(folder)/* \
    firmware/$(folder)/*/* firmware/$(folder)/*/*/*))))
BASE_SOURCES := $(call library_files,base,c)
LIBRARIES := bslam vision link
LIBRARY_SOURCES_bslam := $(BASE_SOURCES) $(call library_files,bslam,c)
LIBRARY_SOURCES_vision := $(BASE_SOURCES) $(call library_files,vision,c)
LIBRARY_SOURCES_link := $(BASE_SOURCES) $(call library_files,link,c)
CORE_SOURCES := $(sort $(foreach library,$(LIBRARIES),$(LIBRARY_SOURCES_$(library))))
CORE_HEADERS := $(call library_files,base bslam vision link,h)
# Of sources $(1) those that a build with flags $(2) takes: without built-in kinds none of their folder.
sources_for = $(filter-out $(if $(filter -DBSLAM_VISION_BUILT_IN=0,$(2)),firmware/vision/built_in/%),$(1))

# The application on top of them, but for its main loop; and what it has on this computer.
ROBOT_SOURCES := $(patsubst %,firmware/robot/%.c,robot health camera_input gyro_wait param_store \
    session messages records map_transfer own_sensors) firmware/bench/text.c
HOST_ROBOT_FLAGS := -DROBOT_VISION=1 -DSESSION_MAP_BYTES=65536

# Contraction (fused multiply-add) would change the last bit from one machine to the next.
C_STANDARD := -std=c11 -ffp-contract=off

C_INCLUDES := -Ifirmware

C_WARNINGS := -Wall -Wextra -Werror -Wconversion -Wfloat-conversion -Wshadow -Wvla -Wundef \
    -Wstrict-prototypes -Wmissing-prototypes -Wcast-align -Wwrite-strings -Wno-psabi

# In the float build a double is a mistake: it costs a library call on a Cortex-M4F.
C_WARNINGS_FLOAT := -Wdouble-promotion -Wunsuffixed-float-constants
