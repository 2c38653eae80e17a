# If sanitizers are enabled, the gate (scripts/test) builds only a quarter of the test programs and
# of the fuzz targets. The commit determines which quarter.
set(SHM_TEST_SHARE 1 CACHE STRING "Build every N-th test program and fuzz target, chosen by SHM_TEST_SEED")
set(SHM_TEST_SEED "" CACHE STRING "Seed that selects the programs if SHM_TEST_SHARE is above 1")

# shm_in_sample(NAME VARIABLE): sets VARIABLE to true if the sample contains the program NAME.
function(shm_in_sample name variable)
  string(SHA256 hash "${SHM_TEST_SEED} ${name}")
  string(SUBSTRING ${hash} 0 6 hash)
  math(EXPR turn "0x${hash} % ${SHM_TEST_SHARE}")
  set(chosen FALSE)
  if(turn EQUAL 0)
    set(chosen TRUE)
  endif()
  set(${variable} ${chosen} PARENT_SCOPE)
endfunction()
