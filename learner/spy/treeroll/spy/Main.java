package treeroll.spy;

import java.awt.AWTError;
import java.awt.Toolkit;
import java.io.IOException;
import javax.swing.JFrame;
import javax.swing.SwingUtilities;

/** lcm-spy, and beside it the rewards of all runs on one channel. */
final class Main {
  private Main() {}

  /** @param arguments the channel. The network is that of LCM_DEFAULT_URL, for both. */
  public static void main(String[] arguments) {
    try {
      open(arguments[0]);
    } catch (AWTError | IOException | LinkageError | RuntimeException error) {
      System.err.println("treeroll-spy: cannot open a window: " + error.getMessage());
      System.exit(1);
    }
  }

  private static void open(String channel) throws IOException {
    new lcm.spy.Spy(null);
    SwingUtilities.invokeLater(
        () -> {
          JFrame frame = new JFrame(RewardPlugin.TITLE + ": " + channel);
          RewardPlugin.listen(channel, frame.getContentPane());
          frame.setSize(800, 560);
          int screen = Toolkit.getDefaultToolkit().getScreenSize().width;
          frame.setLocation(Math.max(0, screen - frame.getWidth()), 0); // beside lcm-spy's
          frame.setVisible(true);
        });
  }
}
