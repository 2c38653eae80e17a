! Writes a bar of hexahedra with a temperature, one time step after the other, as a solver would. Each step is readable
! as soon as it is committed, even if the solver is killed later.
!     gfortran shmformat.f90 live_solver.f90 -lshmformat_c -o live_solver && ./live_solver bar.shm
program live_solver
  use shmformat
  implicit none
  integer, parameter :: cells = 100, vertices = 4 * (cells + 1), steps = 20
  real(c_double), target :: points(3, vertices), temperature(vertices)
  integer(c_int32_t), target :: corners(8, cells)
  character(kind=c_char), target :: name(12) = [character(kind=c_char) :: 't', 'e', 'm', 'p', 'e', 'r', 'a', 't', &
      'u', 'r', 'e', c_null_char]
  real(c_double) :: times(steps)
  type(shmf_error) :: why
  type(shmf_array) :: array
  type(shmf_target) :: mesh(2)
  type(shmf_write_options) :: options
  type(c_ptr) :: writer
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
  options%live = 1
  options%replace = 1
  array%name = c_loc(name)
  array%per_step = 1
  mesh(1)%data = c_loc(points)
  mesh(1)%bytes = 8 * size(points)
  mesh(2)%what = SHMF_CORNERS
  mesh(2)%type = SHMF_INT32
  mesh(2)%data = c_loc(corners)
  mesh(2)%bytes = 4 * size(corners)

  call check(shmf_writer_path(trim(path)//c_null_char, options, writer, why))
  call check(shmf_writer_block(writer, shmf_block(), why))
  call check(shmf_writer_array(writer, array, why))
  call check(shmf_writer_mesh(writer, mesh, 2_c_size_t, why))
  do step = 1, steps
    times(step) = 0.5d0 * (step - 1)
    temperature = 300 + points(1, :) * times(step)
    call check(shmf_writer_values(writer, 0, int(step - 1, c_int64_t), c_loc(temperature), 8_c_int64_t * vertices, why))
    call check(shmf_writer_times(writer, times, int(step, c_int64_t), why))
    call check(shmf_writer_commit(writer, why))
  end do
  call check(shmf_writer_finish(writer, bytes, why))
  call shmf_writer_free(writer)
  print '(i0, a)', steps, ' steps are committed'
contains
  subroutine check(status)
    integer(c_int), intent(in) :: status
    if (status == SHMF_OK) return
    write (0, '(a)') trim(shmf_text(why%message))
    stop 1
  end subroutine
end program
