! Writes a bar of hexahedra with a temperature at three time steps, as a solver would, and reads it back.
!     gfortran shmformat.f90 write_steps.f90 -lshmformat_c -o write_steps && ./write_steps bar.shm
program write_steps
  use shmformat
  implicit none
  integer, parameter :: cells = 100, vertices = 4 * (cells + 1)
  real(c_double), target :: points(3, vertices), temperature(vertices)
  integer(c_int32_t), target :: corners(8, cells)
  character(kind=c_char), target :: name(12) = [character(kind=c_char) :: 't', 'e', 'm', 'p', 'e', 'r', 'a', 't', &
      'u', 'r', 'e', c_null_char]
  real(c_double), parameter :: times(3) = [0d0, 0.5d0, 1d0]
  type(shmf_error) :: why
  type(shmf_array) :: array
  type(shmf_target) :: mesh(2), want(1)
  type(c_ptr) :: writer, file
  character(len=255) :: path
  integer(c_int64_t) :: bytes
  integer :: i, step
  call get_command_argument(1, path)
  do i = 1, vertices                    ! each layer has four vertices around the x axis
    points(:, i) = [(i - 1) / 4 * 0.1d0, merge(1d0, 0d0, modulo(i, 4) >= 2), merge(1d0, 0d0, modulo(i - 1, 4) >= 2)]
  end do
  do i = 1, cells
    corners(:, i) = 4 * (i - 1) + [0, 1, 2, 3, 4, 5, 6, 7]
  end do
  array%name = c_loc(name)
  array%per_step = 1
  mesh(1)%data = c_loc(points)
  mesh(1)%bytes = 8 * size(points)
  mesh(2)%what = SHMF_CORNERS
  mesh(2)%type = SHMF_INT32
  mesh(2)%data = c_loc(corners)
  mesh(2)%bytes = 4 * size(corners)

  call check(shmf_writer_path(trim(path)//c_null_char, shmf_write_options(), writer, why))
  call check(shmf_writer_block(writer, shmf_block(), why))
  call check(shmf_writer_array(writer, array, why))
  call check(shmf_writer_mesh(writer, mesh, 2_c_size_t, why))
  do step = 1, 3
    temperature = 300 + points(1, :) * times(step)
    call check(shmf_writer_values(writer, 0, int(step - 1, c_int64_t), c_loc(temperature), 8_c_int64_t * vertices, why))
  end do
  call check(shmf_writer_times(writer, times, 3_c_int64_t, why))
  call check(shmf_writer_finish(writer, bytes, why))
  call shmf_writer_free(writer)

  call check(shmf_open_path(trim(path)//c_null_char, c_null_ptr, file, why))
  want(1) = shmf_target(what=SHMF_VALUES, step=2, data=c_loc(temperature), bytes=8 * vertices)
  call check(shmf_read(file, want, 1_c_size_t, c_null_ptr, why))
  call shmf_close(file)
  print '(a, f6.1, a, f6.1)', 'temperature: ', minval(temperature), ' to', maxval(temperature)
contains
  subroutine check(status)
    integer(c_int), intent(in) :: status
    if (status == SHMF_OK) return
    write (0, '(a)') trim(shmf_text(why%message))
    stop 1
  end subroutine
end program
