"""All rows of the table of inputs, in the order of the manual."""
import rows_camera
import rows_cart
import rows_draw
import rows_hand_eye
import rows_points
import rows_poses_people
import rows_register
import rows_trust
import rows_volume


def all_rows():
    rows = [*rows_camera.ROWS, *rows_hand_eye.ROWS, *rows_points.ROWS, *rows_poses_people.ROWS, *rows_register.ROWS, *rows_volume.ROWS, *rows_draw.ROWS,
            *rows_cart.ROWS, *rows_trust.ROWS]
    commands = list(dict.fromkeys(row.command for row in rows))
    return sorted(rows, key=lambda row: commands.index(row.command))
